#include "protocol/topics.h"

#include <gtest/gtest.h>

#include "protocol/errors.h"

namespace volto::protocol {
namespace {

TEST(TopicsTest, TopicsAreMadeAndRead) {
  EXPECT_EQ(makeTopic(MessageKind::weights, "anna"), "weights/anna/");
  EXPECT_EQ(makeTopic(MessageKind::mesh, "Ann-A_2.1"), "mesh/Ann-A_2.1/");
  EXPECT_EQ(makeTopic(MessageKind::landmarks, "caf\xC3\xA9"), "landmarks/caf\xC3\xA9/");
  EXPECT_EQ(makeTopic(MessageKind::status), "status/");
  for (std::size_t i = 0; i < kMessageKindCount; ++i) {
    const auto kind = static_cast<MessageKind>(i);
    const std::string text = makeTopic(kind, "anna");
    const std::optional<Topic> topic = parseTopic(text);
    ASSERT_TRUE(topic.has_value()) << text;
    EXPECT_EQ(topic->kind, kind);
    EXPECT_EQ(topic->name, kind == MessageKind::status ? "" : "anna");
  }
}

TEST(TopicsTest, WhatIsNoTopicIsNotRead) {
  for (const std::string_view text :
       {"", "weights", "weights/", "weights//", "weights/anna", "weights/an na/", "weights/a/b/", "status/x/", "status",
        "Weights/anna/", "weights/../", "weights/\n/", "xweights/anna/"}) {
    EXPECT_FALSE(parseTopic(text).has_value()) << text;
  }
  EXPECT_FALSE(parseTopic("weights/" + std::string(129, 'x') + "/").has_value());
  EXPECT_TRUE(parseTopic("weights/" + std::string(128, 'x') + "/").has_value());
}

TEST(TopicsTest, BadNamesAreRefusedWithTheNameInTheMessage) {
  try {
    makeTopic(MessageKind::mesh, "a/b");
    FAIL();
  } catch (const SetupError& e) {
    EXPECT_EQ(e.exitStatus(), 2);
    EXPECT_NE(std::string(e.what()).find("'a/b'"), std::string::npos);
  }
}

TEST(TopicsTest, AnyTextBecomesAName) {
  EXPECT_EQ(topicNameFrom("My head (2).obj"), "My_head__2_.obj");
  EXPECT_EQ(topicNameFrom(""), "unnamed");
  EXPECT_EQ(topicNameFrom(".."), "unnamed");
  EXPECT_TRUE(isTopicName(topicNameFrom(std::string(500, '/'))));
}

TEST(TopicsTest, SubscriptionOfOneNameDoesNotCatchALongerOne) {
  EXPECT_TRUE(subscriptionMatches("weights/anna/", makeTopic(MessageKind::weights, "anna")));
  EXPECT_FALSE(subscriptionMatches("weights/anna/", makeTopic(MessageKind::weights, "anna2")));
  EXPECT_TRUE(subscriptionMatches("", makeTopic(MessageKind::status)));
}

}  // namespace
}  // namespace volto::protocol
