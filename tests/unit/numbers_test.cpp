#include "common/numbers.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

#include "glint/formats/number_text.h"

namespace glint::apps::numbers_test {
namespace {

TEST(Numbers, MayHaveASignZerosInFrontAndBlanksAround) {
  int whole = 0;
  EXPECT_EQ(parseNumber("010", whole), "");
  EXPECT_EQ(whole, 10);
  EXPECT_EQ(parseNumber(" +7\t", whole), "");
  EXPECT_EQ(whole, 7);
  EXPECT_EQ(parseNumber("-2147483648", whole), "");
  EXPECT_EQ(whole, std::numeric_limits<int>::min());
  double real = 0;
  EXPECT_EQ(parseNumber("+.5e1", real), "");
  EXPECT_EQ(real, 5);
}

TEST(Numbers, KeepTheirValueWhereTheTextIsNone) {
  for (const char* text :
       {"", " ", "+", "-", "x", "1x", "1 2", "+-1", "++1", "0x10", "1,5", "nan", "-inf", "infinity", "1e999"}) {
    double real = 3;
    EXPECT_NE(parseNumber(text, real), "") << text;
    EXPECT_EQ(real, 3) << text;
    int whole = 3;
    EXPECT_NE(parseNumber(text, whole), "") << text;
    EXPECT_EQ(whole, 3) << text;
  }
}

TEST(Numbers, ThatDoNotFitAreRefusedNotSaturated) {
  int whole = 3;
  EXPECT_EQ(parseNumber("2147483648", whole), "'2147483648' is not in the range -2147483648 to 2147483647");
  EXPECT_EQ(parseNumber("1.5", whole), "'1.5' is not a whole number");
  EXPECT_EQ(whole, 3);
  std::uint64_t natural = 3;
  EXPECT_NE(parseNumber("18446744073709551616", natural), "");
  EXPECT_NE(parseNumber("-1", natural), "");
  EXPECT_EQ(natural, 3u);
  EXPECT_EQ(parseNumber("18446744073709551615", natural), "");
  EXPECT_EQ(natural, std::numeric_limits<std::uint64_t>::max());
  float real = 3;
  EXPECT_EQ(parseNumber("1e39", real), "'1e39' is out of the range of numbers");
  EXPECT_EQ(real, 3);
}

TEST(Numbers, TooSmallForAFloatBecomeTheNearestOne) {
  float real = 3;
  EXPECT_EQ(parseNumber("1e-60", real), "");
  EXPECT_EQ(real, 0);
}

TEST(Numbers, InMessagesReadBackAsTheSame) {
  EXPECT_EQ(formats::numberText(1e-7), "1e-07");
  EXPECT_EQ(formats::numberText(0.001f), "0.001");
  EXPECT_EQ(formats::numberText(-12), "-12");
}

TEST(Numbers, InPairsAreJoinedByAnX) {
  int rows = 1, columns = 2;
  EXPECT_TRUE(parseProduct("065x128", rows, columns));
  EXPECT_EQ(rows, 65);
  EXPECT_EQ(columns, 128);
  for (const char* text : {"65", "65x", "x128", "65x128x3", "-1x2", "1x4294967297", "0x1F"})
    EXPECT_FALSE(parseProduct(text, rows, columns)) << text;
  EXPECT_EQ(rows, 65);
}

}  // namespace
}  // namespace glint::apps::numbers_test
