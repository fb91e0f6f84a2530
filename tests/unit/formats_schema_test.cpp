#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "common/schema_json.h"
#include "glint/formats/rules.h"
#include "glint/formats/schema.h"
#include "glint/formats/size_expression.h"
#include "support/source_folder.h"

namespace glint::formats::formats_schema_test {
namespace {

std::string readText(const std::string& path) {
  std::ifstream file(test::sourceFolder() / path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST(Schema, CommittedJsonIsTheTable) {
  if (const char* update = std::getenv("GLINT_UPDATE_SCHEMA"); update != nullptr) {
    std::ofstream(test::sourceFolder() / "formats/schema.json") << apps::schemaText();
  }
  EXPECT_EQ(readText("formats/schema.json"), apps::schemaText()) << "run this test with GLINT_UPDATE_SCHEMA=1 to write it anew";
}

TEST(Schema, SpecNamesEveryRuleKindAndDataset) {
  const std::string spec = readText("formats/SPEC.md");
  for (const Rule& rule : rules()) {
    const std::string line =
        "| `" + std::string(rule.id) + "` | " + std::string(name(rule.severity)) + " | " + std::string(rule.summary) + " |";
    EXPECT_NE(spec.find(line), std::string::npos) << line;
  }
  for (const KindSchema* kind : kindSchemas()) {
    EXPECT_NE(spec.find("`" + std::string(kind->name) + "`"), std::string::npos) << kind->name;
    for (const AttributeSchema& attribute : kind->attributes) {
      EXPECT_NE(spec.find("`" + std::string(attribute.name) + "`"), std::string::npos) << attribute.name;
    }
    for (const DatasetSchema& dataset : kind->datasets) {
      const std::string path(dataset.path.substr(dataset.path.rfind('/') + 1));
      const std::string written = path == "level_{l}" ? "bounds/level_LL" : path;
      EXPECT_NE(spec.find("`" + written + "`"), std::string::npos) << dataset.path;
    }
  }
}

TEST(Schema, SizeExpressionsFollowArithmetic) {
  SizeScope scope;
  scope.values = {{"width", {33}}, {"rows", {4, 2, 1}}};
  scope.level = 1;
  EXPECT_EQ(evaluateSize("16", scope), 16u);
  EXPECT_EQ(evaluateSize("width + 2 * 3", scope), 39u);
  EXPECT_EQ(evaluateSize("(width + 2) * 3", scope), 105u);
  EXPECT_EQ(evaluateSize("ceil_div(width, pow2(l + 1))", scope), 9u);
  EXPECT_EQ(evaluateSize("rows[l] * rows[0]", scope), 8u);
}

TEST(Schema, SizeExpressionsThatCannotBeEvaluatedGiveNothing) {
  SizeScope scope;
  scope.values = {{"rows", {4}}, {"huge", {1ull << 40}}};
  scope.level = 1;
  for (const char* bad :
       {"", "unknown", "rows[l]", "1 +", "ceil_div(1, 0)", "pow2(80)", "huge * huge", "(1", "1)", "rows rows", "-1"}) {
    EXPECT_EQ(evaluateSize(bad, scope), std::nullopt) << bad;
  }
}

}  // namespace
}  // namespace glint::formats::formats_schema_test
