#include "tools/animation/animation_script.h"

#include <gtest/gtest.h>

#include "rig/errors.h"
#include "tools/cli/nearest_match.h"

namespace volto::animation {
namespace {

const std::vector<std::string> kShapes = {"jawOpen", "mouthSmileLeft", "mouthSmileRight", "my shape"};

AnimationScript parse(std::string_view text) {
  return AnimationScript::parse(text, "script", kShapes, cli::nearestMatch);
}
std::string complaint(std::string_view text) {
  try {
    parse(text);
  } catch (const rig::InputError& error) {
    return error.what();
  }
  return "accepted";
}
AnimationScript::Moment at(const AnimationScript& script, double t_s) {
  AnimationScript::Moment moment;
  script.at(t_s, moment);
  return moment;
}

TEST(AnimationScript, PlainLinesGoLinearlyFromWeightsToWeights) {
  const AnimationScript script = parse("2 1 0 0.5 0\n1, 0, 0, 0.5, 0.2\n");
  EXPECT_DOUBLE_EQ(script.durationS(), 3);
  EXPECT_EQ(at(script, 0).weights, (std::vector<float>{0, 0, 0, 0}));
  EXPECT_EQ(at(script, 1).weights, (std::vector<float>{0.5F, 0, 0.25F, 0}));
  EXPECT_EQ(at(script, 2).weights, (std::vector<float>{1, 0, 0.5F, 0}));
  EXPECT_FLOAT_EQ(at(script, 2.5).weights[3], 0.1F);
  EXPECT_EQ(at(script, 99).weights, (std::vector<float>{0, 0, 0.5F, 0.2F}));
  EXPECT_EQ(at(script, -1).weights, (std::vector<float>{0, 0, 0, 0}));
}

TEST(AnimationScript, NamedStatementsChangeWhatTheyNameAndNothingElse) {
  const AnimationScript script = parse(
      "# a smile, then a word\n"
      "define smile = mouthSmileLeft 1, mouthSmileRight 0.5\n"
      "to 1: smile 0.8, headYaw -20\n"
      "hold 1   # let it be seen\n"
      "repeat 2\n"
      "  to 0.5 in: jawOpen, my shape 0.25\n"
      "  to 0.5 out: jawOpen 0\n"
      "end\n"
      "neutral 2 smooth\n");
  EXPECT_DOUBLE_EQ(script.durationS(), 6);
  EXPECT_EQ(script.stepCount(), 7U);
  EXPECT_FLOAT_EQ(at(script, 1.5).weights[1], 0.8F);
  EXPECT_FLOAT_EQ(at(script, 1.5).weights[2], 0.4F);
  EXPECT_FLOAT_EQ(at(script, 1.5).head_degrees[0], -20);
  EXPECT_FLOAT_EQ(at(script, 2.25).weights[0], 0.25F);  // half the way, slow start: a quarter
  EXPECT_FLOAT_EQ(at(script, 2.75).weights[0], 0.25F);  // slow end: three quarters of the way back
  EXPECT_FLOAT_EQ(at(script, 3.5).weights[0], 1);       // the second time
  EXPECT_FLOAT_EQ(at(script, 3.5).weights[1], 0.8F);
  EXPECT_FLOAT_EQ(at(script, 4.5).weights[1], 0.8F * (1 - 0.15625F));
  EXPECT_EQ(at(script, 6).weights, (std::vector<float>{0, 0, 0, 0}));
  EXPECT_EQ(at(script, 6).head_degrees[0], 0);
}

TEST(AnimationScript, StepWithoutDurationIsThereAtOnce) {
  const AnimationScript script = parse("to 0: jawOpen 1\nhold 1\n");
  EXPECT_EQ(at(script, 0).weights[0], 1);
}

TEST(AnimationScript, MistakesAreNamedWithTheirLine) {
  EXPECT_EQ(complaint("1 0 0 0\n"), "script:1: a duration and 3 weights; the character has 4 shapes");
  EXPECT_EQ(complaint("\nto 1: jawOpne 1\n"), "script:2: the character has no shape 'jawOpne'; did you mean jawOpen?");
  EXPECT_EQ(complaint("to -1: jawOpen 1\n"), "script:1: a duration of -1 s; time does not run backward");
  EXPECT_EQ(complaint("-1 0 0 0 0\n"), "script:1: a duration of -1 s; time does not run backward");
  EXPECT_EQ(complaint("to 1: jawOpen 1.5\n"), "script:1: jawOpen comes to 1.5; weights are 0 to 1");
  EXPECT_EQ(complaint("1 0 0 nan 0\n"), "script:1: 'nan' is no weight");
  EXPECT_EQ(complaint("wait 1\n"), "script:1: 'wait' is no statement; to, hold, neutral, repeat, end and define are");
  EXPECT_EQ(complaint("nuetral 1\n"), "script:1: 'nuetral' is no statement; did you mean neutral?");
  EXPECT_EQ(complaint("to 1 fast: jawOpen\n"), "script:1: 'fast' is no easing; linear, smooth, in and out are");
  EXPECT_EQ(complaint("to 1 jawOpen\n"), "script:1: no ':' between the duration and the shapes, as in to 0.5: jawOpen 1");
  EXPECT_EQ(complaint("end\n"), "script:1: an end without its repeat");
  EXPECT_EQ(complaint("hold 1\nrepeat 2\nhold 1\n"), "script:2: this repeat has no end; add a line 'end'");
  EXPECT_EQ(complaint("repeat 0\nend\n"), "script:1: repeat '0': give how often, a whole number from 1 on");
  EXPECT_EQ(complaint("# nothing\n"), "script: no step in this script; a first one: to 0.5: jawOpen 1");
  EXPECT_EQ(complaint("define jawOpen = my shape 1\n"), "script:1: 'jawOpen' is there already; choose another name");
  EXPECT_EQ(complaint("to 1: headYaw 120\n"), "script:1: headYaw comes to 120 degrees; a head turns by 90 at most");
}

TEST(AnimationScript, BillionRepetitionsAreRefusedBeforeTheyAreUnrolled) {
  EXPECT_EQ(complaint("repeat 1000000000\nhold 1\nend\n"),
            "script:1: from here on the script lasts 2.778e+05 hours; the limit is 24. Play a shorter one with --loop");
  EXPECT_EQ(complaint("repeat 1000000000\nhold 0\nend\n"),
            "script:1: with its repetitions the script has 1e+09 steps; the limit is 100000. Play a shorter one with --loop");
  EXPECT_EQ(complaint("repeat 18446744073709551615\nrepeat 18446744073709551615\nend\nend\nhold 1\n"), "accepted");
}

}  // namespace
}  // namespace volto::animation
