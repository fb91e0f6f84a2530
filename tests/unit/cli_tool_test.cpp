#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/answer_columns.h"
#include "common/files.h"
#include "common/suggest.h"
#include "common/tool.h"

namespace glint::apps::cli_tool_test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// What a run printed and returned.
struct Outcome {
  int code;
  std::string out;
  std::string err;
};

class ToolRun : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) / ("glint_cli_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    std::ofstream(path("in.png")) << "pixels";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  Outcome run(
      std::vector<std::string> arguments, const std::function<void(Tool&)>& work = [](Tool&) {}) {
    Tool tool({"glint-test", "Tests the flags", "glint-test in.png -o out.glint"});
    const InputFile input(tool, "an image");
    const OutputFile output(tool, OutputFormat::asset, "an asset");
    tool.option("--alpha", alpha_, "roughness").range(0, 1);
    tool.option("--levels", levels_, "levels");
    if (uses_seed_) tool.usesSeed();
    tool.choice("--surface", surface_, {{"flat", 0}, {"smooth", 1}}, "surface");
    arguments.insert(arguments.begin(), "glint-test");
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    const int code = tool.run(static_cast<int>(argv.size()), argv.data(), [&] { work(tool); });
    return {code, ::testing::internal::GetCapturedStdout(), ::testing::internal::GetCapturedStderr()};
  }

  std::vector<std::string> good() const { return {path("in.png"), "-o", path("out.glint")}; }
  std::vector<std::string> goodWith(std::vector<std::string> more) const {
    std::vector<std::string> all = good();
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  std::filesystem::path folder_;
  float alpha_ = 0.3f;
  std::vector<int> levels_ = {1};
  bool uses_seed_ = false;
  int surface_ = 0;
};

TEST_F(ToolRun, SucceedsSilently) {
  const Outcome outcome = run(good());
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(outcome.err, "");
}

TEST_F(ToolRun, ParsesListsWithoutSwallowingInputs) {
  const Outcome outcome = run({"--levels", "1,2,3", path("in.png"), "-o", path("out.glint")});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(levels_, (std::vector<int>{1, 2, 3}));
}

TEST_F(ToolRun, RecordsEveryParameterThatChangesTheResult) {
  std::string command;
  uses_seed_ = true;
  run(goodWith({"--surface", "smooth", "--seed", "7", "--threads", "1"}), [&](Tool& tool) { command = tool.commandJson(); });
  EXPECT_EQ(command, R"({"alpha":0.3,"levels":[1],"seed":7,"surface":"smooth"})");
}

TEST_F(ToolRun, RecordsInputsByNameAndContents) {
  formats::Provenance provenance;
  run(good(), [&](Tool& tool) { provenance = tool.provenance(); });
  ASSERT_EQ(provenance.inputs.size(), 1u);
  EXPECT_EQ(provenance.inputs[0].name, "in.png");  // without the folder
  const std::string first = provenance.inputs[0].hash_hex;
  std::ofstream(path("in.png")) << "other pixels";
  run(good(), [&](Tool& tool) { provenance = tool.provenance(); });
  EXPECT_NE(provenance.inputs[0].hash_hex, first);
}

TEST_F(ToolRun, LeavesAnUnusedSeedOutOfTheRecord) {
  std::string command;
  run(goodWith({"--seed", "7"}), [&](Tool& tool) { command = tool.commandJson(); });
  EXPECT_FALSE(json::parse(command).contains("seed"));
}

TEST_F(ToolRun, RefusesToGiveASeedThatItWouldNotRecord) {
  const Outcome outcome = run(good(), [](Tool& tool) { tool.seed(); });
  EXPECT_EQ(outcome.code, 4);
  EXPECT_THAT(outcome.err, HasSubstr("takes a seed that it does not record"));
}

TEST_F(ToolRun, ReadsNumbersAsDecimalWhereverTheyStand) {
  std::uint64_t seed = 0;
  int threads = 0;
  uses_seed_ = true;
  const auto look = [&](Tool& tool) {
    seed = tool.seed();
    threads = tool.threads();
  };
  ASSERT_EQ(run(goodWith({"--seed", "0010", "--threads", "02", "--levels", "010,+8", "--alpha", "00.5"}), look).code, 0);
  EXPECT_EQ(seed, 10u);
  EXPECT_EQ(threads, 2);
  EXPECT_EQ(levels_, (std::vector<int>{10, 8}));
  EXPECT_EQ(alpha_, 0.5f);
  std::ofstream(path("run.toml")) << "seed = 0011\nlevels = [07, 017]\n";
  ASSERT_EQ(run(goodWith({"--config", path("run.toml")}), look).code, 0);
  EXPECT_EQ(seed, 11u);
  EXPECT_EQ(levels_, (std::vector<int>{7, 17}));
  ASSERT_EQ(run(goodWith({"--seed", "18446744073709551615"}), look).code, 0);
  EXPECT_EQ(seed, ~std::uint64_t{0});
}

TEST_F(ToolRun, RefusesWholeNumbersThatDoNotFit) {
  const std::vector<std::vector<std::string>> all = {{"--seed", "18446744073709551616"},
                                                     {"--seed", "-1"},
                                                     {"--seed", "1.5"},
                                                     {"--seed", "0x10"},
                                                     {"--threads", "4294967297"},
                                                     {"--threads", "-1"},
                                                     {"--levels", "1,2147483648"},
                                                     {"--levels", "1,2.5"},
                                                     {"--levels", "1e3"},
                                                     {"--alpha", "+-0.1"},
                                                     {"--alpha", "0x1p-2"},
                                                     {"--alpha", "1e-999"}};
  for (const std::vector<std::string>& arguments : all) {
    const Outcome outcome = run(goodWith(arguments));
    EXPECT_EQ(outcome.code, 1) << arguments[1];
    EXPECT_THAT(outcome.err, HasSubstr(arguments[0] + ": ")) << arguments[1];
  }
}

TEST_F(ToolRun, SuggestsTheNearestOption) {
  const Outcome outcome = run({path("in.png"), "--ouptut", path("out.glint")});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("unknown option --ouptut; did you mean --output?"));
}

TEST_F(ToolRun, SuggestsTheNearestWord) {
  const Outcome outcome = run(goodWith({"--surface", "smoth"}));
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("did you mean 'smooth'?"));
}

TEST_F(ToolRun, RefusesNumbersOutOfRangeAndNotFinite) {
  for (const char* value : {"1.5", "-0.1", "nan", "inf", "abc", "", "0.5x"}) {
    const Outcome outcome = run(goodWith({"--alpha", value}));
    EXPECT_EQ(outcome.code, 1) << value;
    EXPECT_THAT(outcome.err, StartsWith("glint-test: error: ")) << value;
  }
}

TEST_F(ToolRun, TurnsErrorsIntoMessageAndExitCode) {
  const Outcome outcome = run(good(), [](Tool&) {
    throw Error(ErrorCode::invalid_input, "normals.finite", "a.png", "texel (3, 7)", "is not finite", "repair it");
  });
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(outcome.err, "glint-test: error: a.png: texel (3, 7): is not finite; repair it\n");
  EXPECT_EQ(outcome.out, "");
}

TEST_F(ToolRun, TellsOfExhaustedMemory) {
  const Outcome outcome = run(good(), [](Tool&) { throw std::bad_alloc(); });
  EXPECT_EQ(outcome.code, 4);
  EXPECT_THAT(outcome.err, HasSubstr("out of memory; use"));
}

TEST_F(ToolRun, PrintsResultsAndErrorsAsJson) {
  const Outcome fine = run(goodWith({"--json"}), [](Tool& tool) {
    tool.setResult({{"texels", 4}});
    tool.print("not for machines");
  });
  const json document = json::parse(fine.out);
  EXPECT_EQ(document["schema"], 1);
  EXPECT_EQ(document["status"], "ok");
  EXPECT_EQ(document["result"]["texels"], 4);

  const Outcome bad = run(goodWith({"--json", "--alpha", "7"}));
  EXPECT_EQ(bad.code, 1);
  EXPECT_EQ(json::parse(bad.out)["error"]["code"], "usage");
}

TEST_F(ToolRun, ChecksPathsBeforeTheWork) {
  bool worked = false;
  const auto work = [&](Tool&) { worked = true; };
  EXPECT_EQ(run({path("none.png"), "-o", path("out.glint")}, work).code, 2);
  EXPECT_EQ(run({path("in.png"), "-o", path("no/such/out.glint")}, work).code, 2);
  EXPECT_EQ(run({path("in.png"), "-o", folder_.string()}, work).code, 2);
  EXPECT_EQ(run({path("in.png"), "-o", "-"}, work).code, 1);
  EXPECT_EQ(run(goodWith({"--depfile", path("no/such/out.d")}), work).code, 2);
  EXPECT_FALSE(worked);
}

TEST_F(ToolRun, ReplacesOnlyItsOwnKindWithoutForce) {
  std::ofstream(path("out.glint")) << "a letter to a friend";
  EXPECT_EQ(run(good()).code, 1);
  EXPECT_EQ(run(goodWith({"--force"})).code, 0);
  std::ofstream(path("out.glint")) << "\x89HDF\r\n\x1a\n of somebody else";
  EXPECT_EQ(run(good()).code, 1);
  std::ofstream(path("out.glint")) << "\x89HDF\r\n\x1a\n and glint_format";
  EXPECT_EQ(run(good()).code, 0);
  EXPECT_EQ(run({path("in.png"), "-o", path("in.png")}).code, 1);
}

TEST_F(ToolRun, ReadsAConfigurationFileAndRefusesUnknownKeys) {
  std::ofstream(path("run.toml")) << "alpha = 0.5\nsurface = \"smooth\"\n";
  EXPECT_EQ(run(goodWith({"--config", path("run.toml"), "--alpha", "0.25"})).code, 0);
  EXPECT_EQ(alpha_, 0.25f);
  EXPECT_EQ(surface_, 1);
  std::ofstream(path("wrong.toml")) << "alhpa = 0.5\n";
  EXPECT_EQ(run(goodWith({"--config", path("wrong.toml")})).code, 1);
  EXPECT_EQ(run(goodWith({"--config", path("none.toml")})).code, 2);
}

TEST_F(ToolRun, WritesADepfile) {
  std::ofstream(path("run.toml")) << "alpha = 0.5\n";
  ASSERT_EQ(run(goodWith({"--depfile", path("out.d"), "--config", path("run.toml")})).code, 0);
  std::ifstream file(path("out.d"));
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  EXPECT_THAT(text, StartsWith(path("out.glint") + ":"));
  EXPECT_THAT(text, HasSubstr(path("in.png") + ":\n"));
  EXPECT_THAT(text, HasSubstr(path("run.toml") + ":\n"));
}

TEST(Depfile, EscapesWhatMakeWouldTakeApart) {
  EXPECT_EQ(makeDepfile({"a b.glint"}, {"c$d.png", "e#f:g"}),
            "a\\ b.glint: \\\n  c$$d.png \\\n  e\\#f\\:g\n\nc$$d.png:\n\ne\\#f\\:g:\n");
  EXPECT_EQ(makeDepfile({"a\\ b"}, {"~c"}), "a\\\\\\ b: \\\n  ./~c\n\n./~c:\n");
}

TEST(Depfile, TakesPercentForASignAmongPrerequisitesOnly) {
  EXPECT_EQ(makeDepfile({"a%.glint"}, {"b%.png"}), "a\\%.glint: \\\n  b%.png\n\nb\\%.png:\n");
  // To ninja the last rule would name an output.
  EXPECT_EQ(makeDepfile({"a.glint"}, {"b%.png"}), "a.glint: \\\n  b%.png\n");
}

TEST(Depfile, RefusesNamesThatMakeCannotHold) {
  for (const char* name : {"b\nc", "b\tc", "b;c", "b|c", "b=c", "b\\#c", "b\\", "b&", "b(c)"}) {
    EXPECT_THROW(makeDepfile({"a"}, {name}), Error) << name;
    EXPECT_THROW(makeDepfile({name}, {"a"}), Error) << name;
  }
}

TEST(Depfile, IsKnownByItsShape) {
  EXPECT_TRUE(isDepfile(makeDepfile({"a b.glint", "c"}, {"d.png", "e"})));
  EXPECT_TRUE(isDepfile(makeDepfile({"a.glint"}, {})));
  EXPECT_FALSE(isDepfile("all:\n\techo\n"));
  EXPECT_FALSE(isDepfile("a.o: a.c a.h\n"));
  EXPECT_FALSE(isDepfile("a letter: \\\n  to a friend\nwith love\n"));
}

TEST(AnswerTable, IsKnownByItsColumns) {
  for (const char* ours :
       {"hx,hy,pdf", "wix,wiy,wiz,pdf", "u,v,sigma,hx,hy,density", "name,u,v,sxx,sxy,syy,x0,y0,x1,y1,mean\r",
        "\xef\xbb\xbfU, V, Sigma, HX, HY,density", "u,v,level,wix,wiy,wiz,wox,woy,woz,reflected_r,reflected_g,reflected_b"})
    EXPECT_TRUE(isAnswerHeader(ours)) << ours;
  for (const char* other : {"", "a letter", "u,v,sigma,hx,hy", "material,density", "u,v,density", "hx,hy,pdf,more", "pdf"})
    EXPECT_FALSE(isAnswerHeader(other)) << other;
}

TEST(Suggest, KeepsQuietWhenNothingIsNear) {
  EXPECT_EQ(nearestName("--thread", {"--threads", "--seed"}), "--threads");
  EXPECT_EQ(nearestName("--unrelated", {"--threads", "--seed"}), "");
}

}  // namespace
}  // namespace glint::apps::cli_tool_test
