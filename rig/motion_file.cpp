#include "rig/motion_file.h"

#include <stdexcept>

#include "rig/pose.h"

namespace volto::rig {
namespace {

constexpr std::size_t kMaxCombinations = 65'536, kMaxNameBytes = 4'096;

void require(bool good, const char* what) {
  if (!good) throw std::invalid_argument(what);
}

template <class T>
std::vector<T> numbers(const flatbuffers::Vector<T>* v) {
  return v == nullptr ? std::vector<T>() : std::vector<T>(v->data(), v->data() + v->size());
}

std::array<float, 3> threeOf(const flatbuffers::Vector<float>* v, const char* what) {
  require(v != nullptr && v->size() == 3, what);
  return {v->Get(0), v->Get(1), v->Get(2)};
}

flatbuffers::Offset<flatbuffers::Vector<float>> three(flatbuffers::FlatBufferBuilder& builder,
                                                      const std::array<float, 3>& p) {
  return builder.CreateVector(p.data(), p.size());
}

flatbuffers::Offset<file::SparseDisplacement> encode(flatbuffers::FlatBufferBuilder& builder,
                                                     const SparseDisplacement& in) {
  const auto vertex = builder.CreateVector(in.vertex);
  const auto displacement = builder.CreateVector(in.displacement.empty() ? nullptr : in.displacement.front().data(),
                                                 3 * in.displacement.size());
  return file::CreateSparseDisplacement(builder, vertex, displacement);
}

SparseDisplacement decode(const file::SparseDisplacement* in) {
  SparseDisplacement out;
  if (in == nullptr) return out;
  out.vertex = numbers(in->vertex());
  const auto displacement = numbers(in->displacement());
  require(displacement.size() == 3 * out.vertex.size(), "a correction's displacements do not fit its vertices");
  out.displacement.resize(out.vertex.size());
  for (std::size_t i = 0; i < out.vertex.size(); ++i)
    out.displacement[i] = {displacement[3 * i], displacement[3 * i + 1], displacement[3 * i + 2]};
  return out;
}

std::vector<flatbuffers::Offset<file::Combination>> encodeCombinations(flatbuffers::FlatBufferBuilder& builder,
                                                                       const Rig& rig) {
  std::vector<flatbuffers::Offset<file::Combination>> out;
  for (const Combination& combination : rig.combinations) {
    std::vector<std::uint16_t> shape;
    std::vector<std::uint8_t> halfway;
    for (const Combination::Driver& driver : combination.drivers) {
      shape.push_back(driver.shape);
      halfway.push_back(driver.halfway ? 1 : 0);
    }
    const auto name = builder.CreateString(combination.name);
    const auto shapes = builder.CreateVector(shape);
    const auto halves = builder.CreateVector(halfway);
    out.push_back(file::CreateCombination(builder, name, shapes, halves, encode(builder, combination.correction),
                                          static_cast<std::uint8_t>(combination.rule)));
  }
  return out;
}

std::vector<flatbuffers::Offset<file::PartMotion>> encodePartMotions(flatbuffers::FlatBufferBuilder& builder,
                                                                     const Rig& rig) {
  std::vector<flatbuffers::Offset<file::PartMotion>> out;
  for (const PartMotion& motion : rig.part_motions) {
    std::vector<std::uint16_t> shape;
    std::vector<float> turn;  // rotation, translation
    for (const PartMotion::Turn& t : motion.turns) {
      shape.push_back(t.shape);
      turn.insert(turn.end(), t.rotation.begin(), t.rotation.end());
      turn.insert(turn.end(), t.translation.begin(), t.translation.end());
    }
    const auto pivot = three(builder, motion.pivot);
    const auto vertices = builder.CreateVector(motion.vertices);
    const auto share = builder.CreateVector(motion.share);
    const auto shapes = builder.CreateVector(shape);
    const auto turns = builder.CreateVector(turn);
    out.push_back(file::CreatePartMotion(builder, static_cast<std::uint8_t>(motion.follows), pivot, vertices, share,
                                         shapes, turns));
  }
  return out;
}

flatbuffers::Offset<file::Samples> encode(flatbuffers::FlatBufferBuilder& builder,
                                          const std::vector<SlitContact::Sample>& samples) {
  std::vector<std::uint32_t> vertex;
  std::vector<float> share;
  for (const SlitContact::Sample& s : samples) {
    vertex.push_back(s.first);
    vertex.push_back(s.second);
    share.push_back(s.share_of_second);
  }
  const auto vertices = builder.CreateVector(vertex);
  return file::CreateSamples(builder, vertices, builder.CreateVector(share));
}

std::vector<SlitContact::Sample> decode(const file::Samples* in) {
  std::vector<SlitContact::Sample> out;
  if (in == nullptr) return out;
  const auto vertex = numbers(in->vertex());
  const auto share = numbers(in->share_of_second());
  require(vertex.size() == 2 * share.size(), "a lip's or lid's samples do not fit together");
  for (std::size_t i = 0; i < share.size(); ++i) out.push_back({vertex[2 * i], vertex[2 * i + 1], share[i]});
  return out;
}

flatbuffers::Offset<file::FoldGuard> encode(flatbuffers::FlatBufferBuilder& builder, const FoldGuard& guard) {
  std::vector<std::uint32_t> triangle, copies;
  std::vector<float> normal;
  for (const auto& t : guard.triangle) triangle.insert(triangle.end(), t.begin(), t.end());
  for (const auto& n : guard.normal) normal.insert(normal.end(), n.begin(), n.end());
  for (const auto& pair : guard.copies) copies.insert(copies.end(), pair.begin(), pair.end());
  const auto triangles = builder.CreateVector(triangle);
  const auto normals = builder.CreateVector(normal), least = builder.CreateVector(guard.least);
  const auto pairs = builder.CreateVector(copies);
  return file::CreateFoldGuard(builder, triangles, static_cast<std::uint32_t>(guard.watched), normals, least, pairs);
}

FoldGuard decode(const file::FoldGuard* in) {
  FoldGuard out;
  if (in == nullptr) return out;
  const auto triangle = numbers(in->triangle()), copies = numbers(in->copies());
  const auto normal = numbers(in->normal());
  out.least = numbers(in->least());
  out.watched = in->watched();
  require(triangle.size() == 3 * out.least.size() && normal.size() == triangle.size() && copies.size() % 2 == 0,
          "triangles that must not fold do not fit together");
  for (std::size_t i = 0; i < triangle.size(); i += 3) {
    out.triangle.push_back({triangle[i], triangle[i + 1], triangle[i + 2]});
    out.normal.push_back({normal[i], normal[i + 1], normal[i + 2]});
  }
  for (std::size_t i = 0; i < copies.size(); i += 2) out.copies.push_back({copies[i], copies[i + 1]});
  return out;
}

void decodeCombinations(const file::Motion& in, Rig& rig) {
  if (in.combinations() == nullptr) return;
  require(in.combinations()->size() <= kMaxCombinations, "more than 65536 combinations");
  for (const file::Combination* combination : *in.combinations()) {
    Combination out;
    require(combination->name()->size() <= kMaxNameBytes, "a combination's name is too long");
    out.name = combination->name()->str();
    const auto shape = numbers(combination->shape());
    const auto halfway = numbers(combination->halfway());
    require(shape.size() == halfway.size(), "a combination's drivers do not fit together");
    for (std::size_t i = 0; i < shape.size(); ++i) out.drivers.push_back({shape[i], halfway[i] != 0});
    out.correction = decode(combination->correction());
    require(combination->rule() <= 1, "a combination of an unknown kind");
    out.rule = static_cast<Combination::Rule>(combination->rule());
    rig.combinations.push_back(std::move(out));
  }
}

void decodePartMotions(const file::Motion& in, Rig& rig) {
  if (in.part_motions() == nullptr) return;
  for (const file::PartMotion* motion : *in.part_motions()) {
    PartMotion out;
    require(motion->follows() <= 4, "a part follows something unknown");
    out.follows = static_cast<RigidPart::Follows>(motion->follows());
    out.pivot = threeOf(motion->pivot(), "a part turns about no point");
    out.vertices = numbers(motion->vertices());
    out.share = numbers(motion->share());
    const auto shape = numbers(motion->shape());
    const auto turn = numbers(motion->turn());
    require(turn.size() == 6 * shape.size(), "a part's turns do not fit its shapes");
    for (std::size_t i = 0; i < shape.size(); ++i) {
      const float* t = turn.data() + 6 * i;
      out.turns.push_back({shape[i], {t[0], t[1], t[2]}, {t[3], t[4], t[5]}});
    }
    rig.part_motions.push_back(std::move(out));
  }
}

void decodeContacts(const file::Motion& in, Contacts& contacts) {
  if (in.balls() != nullptr)
    for (const file::BallContact* ball : *in.balls())
      contacts.balls.push_back({threeOf(ball->centre(), "an eyeball without a centre"), ball->radius(),
                                numbers(ball->vertex()), numbers(ball->distance()), numbers(ball->outer()),
                                numbers(ball->hold())});
  if (in.slits() != nullptr)
    for (const file::SlitContact* slit : *in.slits()) {
      SlitContact out;
      require(slit->place() <= 2, "lips or lids at an unknown place");
      out.place = static_cast<SlitContact::Place>(slit->place());
      out.ball = slit->ball();
      out.up = threeOf(slit->up(), "lips or lids without a direction");
      out.upper_share = slit->upper_share();
      out.upper = decode(slit->upper());
      out.lower = decode(slit->lower());
      out.least_gap = numbers(slit->least_gap());
      out.vertex = numbers(slit->vertex());
      out.column = numbers(slit->column());
      out.share = numbers(slit->share());
      out.reach = numbers(slit->reach());
      contacts.slits.push_back(std::move(out));
    }
  const auto rider = numbers(in.rider()), anchor = numbers(in.rider_anchor());
  const auto weight = numbers(in.rider_weight());
  const auto ball = numbers(in.rider_ball());
  require(anchor.size() == 3 * rider.size() && weight.size() == anchor.size() && ball.size() == rider.size(),
          "riders do not fit together");
  for (std::size_t i = 0; i < rider.size(); ++i)
    contacts.riders.push_back({rider[i],
                               {anchor[3 * i], anchor[3 * i + 1], anchor[3 * i + 2]},
                               {weight[3 * i], weight[3 * i + 1], weight[3 * i + 2]},
                               ball[i]});
  contacts.folds = decode(in.folds());
}

}  // namespace

flatbuffers::Offset<file::Motion> encodeMotion(flatbuffers::FlatBufferBuilder& builder, const Rig& rig) {
  std::vector<flatbuffers::Offset<file::SparseDisplacement>> corrections;
  for (const Blendshape& shape : rig.blendshapes) corrections.push_back(encode(builder, shape.correction));
  const auto correction_vector = builder.CreateVector(corrections);
  const auto combinations = builder.CreateVector(encodeCombinations(builder, rig));
  const auto motions = builder.CreateVector(encodePartMotions(builder, rig));
  const Contacts& contacts = rig.contacts;
  std::vector<flatbuffers::Offset<file::BallContact>> balls;
  for (const BallContact& ball : contacts.balls) {
    const auto centre = three(builder, ball.centre);
    const auto vertex = builder.CreateVector(ball.vertex);
    const auto distance = builder.CreateVector(ball.distance), outer = builder.CreateVector(ball.outer),
               hold = builder.CreateVector(ball.hold);
    balls.push_back(file::CreateBallContact(builder, centre, ball.radius, vertex, distance, outer, hold));
  }
  const auto ball_vector = builder.CreateVector(balls);
  std::vector<flatbuffers::Offset<file::SlitContact>> slits;
  for (const SlitContact& slit : contacts.slits) {
    const auto up = three(builder, slit.up);
    const auto upper = encode(builder, slit.upper), lower = encode(builder, slit.lower);
    const auto least_gap = builder.CreateVector(slit.least_gap);
    const auto vertex = builder.CreateVector(slit.vertex);
    const auto column = builder.CreateVector(slit.column), share = builder.CreateVector(slit.share),
               reach = builder.CreateVector(slit.reach);
    slits.push_back(file::CreateSlitContact(builder, static_cast<std::uint8_t>(slit.place), slit.ball, up,
                                            slit.upper_share, upper, lower, least_gap, vertex, column, share, reach));
  }
  const auto slit_vector = builder.CreateVector(slits);
  std::vector<std::uint32_t> rider, anchor;
  std::vector<float> weight;
  std::vector<std::int32_t> rider_ball;
  for (const Rider& r : contacts.riders) {
    rider.push_back(r.vertex);
    anchor.insert(anchor.end(), r.anchor.begin(), r.anchor.end());
    weight.insert(weight.end(), r.weight.begin(), r.weight.end());
    rider_ball.push_back(r.ball);
  }
  const auto riders = builder.CreateVector(rider), anchors = builder.CreateVector(anchor);
  const auto weights = builder.CreateVector(weight);
  const auto rider_balls = builder.CreateVector(rider_ball);
  const auto folds = encode(builder, contacts.folds);
  return file::CreateMotion(builder, correction_vector, combinations, motions, ball_vector, slit_vector, riders,
                            anchors, weights, rider_balls, folds);
}

void decodeMotion(const file::Motion* motion, Rig& rig) {
  if (motion == nullptr) return;
  const auto* corrections = motion->corrections();
  require(corrections != nullptr && corrections->size() == rig.blendshapes.size(),
          "there is not one correction for each blendshape");
  for (std::size_t k = 0; k < rig.blendshapes.size(); ++k)
    rig.blendshapes[k].correction = decode(corrections->Get(static_cast<flatbuffers::uoffset_t>(k)));
  decodeCombinations(*motion, rig);
  decodePartMotions(*motion, rig);
  decodeContacts(*motion, rig.contacts);
  checkPoseData(rig);
}

}  // namespace volto::rig
