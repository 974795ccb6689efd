#include "frames/arkit_blendshapes.h"

#include <gtest/gtest.h>

#include <set>

namespace volto {

TEST(ArkitBlendshapes, FiftyTwoDifferentNames) {
  const std::set<std::string_view> names(kArkitBlendshapeNames.begin(), kArkitBlendshapeNames.end());
  EXPECT_EQ(names.size(), 52U);
  EXPECT_FALSE(names.contains(""));
}

TEST(ArkitBlendshapes, NameIsFoundInEitherSpelling) {
  EXPECT_EQ(arkitBlendshapeIndex("jawOpen"), arkitBlendshapeIndex("JawOpen"));
  EXPECT_EQ(kArkitBlendshapeNames[arkitBlendshapeIndex("MouthSmileLeft").value()], "mouthSmileLeft");
  EXPECT_FALSE(arkitBlendshapeIndex("mouthSmile").has_value());
  EXPECT_FALSE(arkitBlendshapeIndex("").has_value());
}

TEST(ArkitBlendshapes, MirrorOfMirrorIsTheShapeItself) {
  for (std::size_t i = 0; i < kArkitBlendshapeCount; ++i) EXPECT_EQ(arkitMirrorIndex(arkitMirrorIndex(i)), i);
  EXPECT_EQ(kArkitBlendshapeNames[arkitMirrorIndex(arkitBlendshapeIndex("jawLeft").value())], "jawRight");
  EXPECT_EQ(kArkitBlendshapeNames[arkitMirrorIndex(arkitBlendshapeIndex("jawOpen").value())], "jawOpen");
}

}  // namespace volto
