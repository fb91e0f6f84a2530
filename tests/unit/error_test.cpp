#include "glint/model/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace glint::error_test {
namespace {

using ::testing::EndsWith;
using ::testing::StartsWith;

TEST(ShownText, KeepsPlainTextOfEveryLanguage) {
  for (const char* text : {"", "plain", "größe", "漢字", "\xf0\x9f\x98\x80", "back\\slash"}) EXPECT_EQ(escapedText(text), text);
}

TEST(ShownText, EscapesWhatIsNoTextOrDrivesATerminal) {
  EXPECT_EQ(escapedText("a\nb\tc\x1b[2J\x7f"), "a\\nb\\tc\\x1b[2J\\x7f");
  EXPECT_EQ(escapedText("\xe9"), "\\xe9");                             // Latin-1
  EXPECT_EQ(escapedText("\xc2\x9b"), "\\xc2\\x9b");                    // a control character of two bytes
  EXPECT_EQ(escapedText("\xc0\xaf"), "\\xc0\\xaf");                    // longer than it need be
  EXPECT_EQ(escapedText("\xed\xa0\x80"), "\\xed\\xa0\\x80");           // half of a pair of UTF-16
  EXPECT_EQ(escapedText("\xe6\xbc"), "\\xe6\\xbc");                    // cut
  EXPECT_EQ(escapedText("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");  // beyond Unicode
}

TEST(ShownText, ShortensBetweenCharacters) {
  EXPECT_EQ(shownText("12345678", 8), "12345678");
  EXPECT_EQ(shownText("123456789", 8), "12345...");
  EXPECT_EQ(shownText("1234\xc3\xa9"
                      "56789",
                      8),
            "1234...");
  EXPECT_EQ(shownPath("123456789", 8), "...56789");
  EXPECT_EQ(shownPath("1234\xc3\xa9"
                      "6789",
                      8),
            "...6789");
}

TEST(ErrorText, IsOneShortLineWhateverComesIn) {
  const std::string much(2000000, '\n');
  const Error error(ErrorCode::io, "rule", "/much/" + much + "/name.png", much, "is wrong" + much, much);
  constexpr std::size_t kSomeHundreds = 1400;
  const std::string text = error.what();
  EXPECT_LE(text.size(), kSomeHundreds);
  EXPECT_EQ(text.find('\n'), text.npos);
  EXPECT_THAT(text, StartsWith("..."));
  EXPECT_NE(text.find("/name.png: "), text.npos);
  EXPECT_THAT(error.clause(), StartsWith("is wrong"));
  EXPECT_THAT(error.clause(), EndsWith("..."));
}

}  // namespace
}  // namespace glint::error_test
