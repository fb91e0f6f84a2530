#include "common/tool.h"

#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <deque>
#include <filesystem>
#include <iterator>
#include <map>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <system_error>

#include "common/error_json.h"
#include "common/files.h"
#include "common/help_formatter.h"
#include "common/input_name.h"
#include "common/memory.h"
#include "common/number_checks.h"
#include "common/progress_reporter.h"
#include "common/signals.h"
#include "common/standard_streams.h"
#include "common/suggest.h"
#include "common/unchanged.h"
#include "glint/formats/hash.h"
#include "glint/model/shown_text.h"

namespace glint::apps {
namespace {

using nlohmann::json;

/// Version of the layout of the --json document.
constexpr int kJsonSchema = 1;
constexpr int kMaxThreads = 1024;
constexpr std::size_t kMostWarning = 1000;  // bytes

/// Floats are recorded as the shortest decimal that reads back the same, so that 0.3 stays 0.3.
json toJson(float value) { return json::parse(fmt::format("{}", value)); }
template <class T>
json toJson(const T& value) {
  return value;
}
json toJson(const std::vector<float>& values) {
  json list = json::array();
  for (const float value : values) list.push_back(toJson(value));
  return list;
}

template <class T>
constexpr bool kIsList = false;
template <class T>
constexpr bool kIsList<std::vector<T>> = true;

/// "-o,--sigma-r" -> "sigma-r", "KIND" -> "kind".
std::string recordKey(const std::string& name) {
  std::string key = name.substr(name.rfind(',') + 1);
  key.erase(0, key.find_first_not_of('-'));
  return CLI::detail::to_lower(key);
}

template <class T>
struct ElementOf {
  using Type = T;
};
template <class T>
struct ElementOf<std::vector<T>> {
  using Type = T;
};

/// Paths may hold any bytes; JSON must be UTF-8.
std::string dump(const json& document) { return document.dump(2, ' ', false, json::error_handler_t::replace); }

/// Configuration files of CLI11, which may begin with a byte-order mark of UTF-8.
struct ConfigFile : CLI::ConfigBase {
  std::vector<CLI::ConfigItem> from_config(std::istream& file) const override {
    constexpr std::string_view kMark = "\xef\xbb\xbf";
    std::string text{std::istreambuf_iterator<char>(file), {}};
    if (text.starts_with(kMark)) text.erase(0, kMark.size());
    std::istringstream rest(text);
    return ConfigBase::from_config(rest);
  }
};

/// Limits the threads of the process to its end: the end of a limit starts threads that have no work, and may fail at it.
void limitThreads(int threads) {
  [[maybe_unused]] static const auto* const limit =
      new tbb::global_control(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
}

}  // namespace

struct Tool::State {
  ToolInfo info;
  CLI::App app;
  std::string section = kOptions;
  std::deque<Option> options;                                            // deque: references handed out stay valid
  std::vector<std::pair<std::string, std::function<json()>>> recorders;  // one for each option, same order
  std::vector<std::function<void()>> checks;
  std::vector<std::function<void()>> late_checks;
  std::vector<std::function<void()>> replace_checks;
  std::vector<std::pair<std::string, std::vector<std::string>>> elsewhere;  // lines of other commands, and their options
  std::vector<std::string> inputs;
  std::vector<std::string> outputs;
  json result = json::object();
  json warnings = json::array();
  std::unique_ptr<ProgressReporter> reporter;
  std::optional<ErrorCode> exit_code;

  /// Leaves the line of the bar to what is printed next. The reporter stays: functions of Tool::progress point to it.
  void clearProgress() const {
    if (reporter) reporter->clear();
  }

  int threads = 0;
  std::uint64_t seed = 1;
  bool uses_seed = false;
  bool json_result = false;
  bool quiet = false;
  bool verbose = false;
  bool force = false;
  bool skip_unchanged = false;
  bool makes_more = false;
  std::function<formats::Provenance()> record;  // of an output that another run's record goes into
  bool trust = false;
  std::uint64_t max_memory = 0;
  ProgressMode progress_mode = ProgressMode::automatic;
  std::string depfile;

  Option& add(CLI::Option* option, const std::string& name, std::function<json()> value) {
    options.emplace_back();
    options.back().option_ = option->group(section);
    if (option->get_default_str() == "[]") option->default_str("");
    recorders.emplace_back(recordKey(name), std::move(value));
    return options.back();
  }
};

Tool::Tool(ToolInfo info) : state_(std::make_unique<State>()) {
  state_->info = std::move(info);
  CLI::App& app = state_->app;
  app.description(state_->info.summary);
  app.name(state_->info.name);
  app.footer((state_->info.notes.empty() ? "" : state_->info.notes + "\n\n") + "Example:\n  " + state_->info.example +
             "\n\nExit codes: 0 ok, 1 usage, 2 input/output, 3 invalid input, 4 failed, 5 unsupported, 7 differs");
  app.formatter(std::make_shared<HelpFormatter>());
  app.get_formatter()->column_width(34);
  app.option_defaults()->always_capture_default();
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.config_formatter(std::make_shared<ConfigFile>());
}

Tool::~Tool() = default;

void Tool::section(const std::string& title) { state_->section = title; }

void Tool::addStandardOptions() {
  State& s = *state_;
  CLI::App& app = s.app;
  const std::string group = "Shared by every tool";
  section(group);
  app.set_help_flag("-h,--help", "print this help and exit")->group(group);
  app.set_version_flag("--version", generator(), "print the version and exit")->group(group);
  app.set_config("--config", "", "read options from a TOML or INI file; the command line has precedence")
      ->group(group)
      ->type_name("FILE");
  app.add_option("--threads", s.threads, "most threads to use; 0: all that the machine has")
      ->group(group)
      ->type_name("N")
      ->transform(strictNumber<int>())
      ->transform(numberRange(0, kMaxThreads));  // the last transform comes first, so that large numbers are told the range
  app.add_option("--max-memory", s.max_memory, "most memory to use, such as 500M or 8G; by default what the machine has left")
      ->group(group)
      ->type_name("SIZE")
      ->default_str("")
      ->transform(memorySize());
  app.add_option("--seed", s.seed, "seed of every random choice")
      ->group(group)
      ->type_name("N")
      ->transform(strictNumber<std::uint64_t>());
  app.add_flag("--json", s.json_result, "print the result, or the error, as one JSON document on stdout")->group(group);
  choice("--progress", s.progress_mode,
         {{"auto", ProgressMode::automatic}, {"none", ProgressMode::none}, {"json", ProgressMode::json}},
         "progress on stderr; auto: a bar, on a terminal only")
      .unrecorded();
  CLI::Option* quiet = app.add_flag("--quiet,-q", s.quiet, "no warnings and no progress")->group(group);
  app.add_flag("--verbose,-v", s.verbose, "print a summary of the result")->group(group)->excludes(quiet);
  app.add_flag("--force,-f", s.force, "replace an output that is an input, read-only or of another kind")->group(group);
  app.add_flag("--skip-unchanged", s.skip_unchanged,
               "leave an asset alone if this version has made it of the same inputs and parameters, and it is whole")
      ->group(group);
  app.add_flag("--trust", s.trust, "do not check hashes and values of assets; for files that glint-validate has accepted")
      ->group(group);
  app.add_option("--depfile", s.depfile, "write what the output depends on, as a Make rule")->group(group)->type_name("FILE");
}

template <class T>
Option& Tool::option(const std::string& name, T& value, const std::string& help) {
  CLI::Option* option = state_->app.add_option(name, value, help);
  if constexpr (kIsList<T>) option->delimiter(',')->allow_extra_args(false);  // must not swallow the positional arguments
  using Element = typename ElementOf<T>::Type;
  if constexpr (std::is_arithmetic_v<Element>) option->transform(strictNumber<Element>());
  return state_->add(option, name, [&value] { return toJson(value); });
}
template Option& Tool::option(const std::string&, int&, const std::string&);
template Option& Tool::option(const std::string&, std::uint64_t&, const std::string&);
template Option& Tool::option(const std::string&, float&, const std::string&);
template Option& Tool::option(const std::string&, double&, const std::string&);
template Option& Tool::option(const std::string&, std::string&, const std::string&);
template Option& Tool::option(const std::string&, std::vector<int>&, const std::string&);
template Option& Tool::option(const std::string&, std::vector<float>&, const std::string&);
template Option& Tool::option(const std::string&, std::vector<double>&, const std::string&);
template Option& Tool::option(const std::string&, std::vector<std::string>&, const std::string&);

Option& Tool::flag(const std::string& name, bool& value, const std::string& help) {
  return state_->add(state_->app.add_flag(name, value, help), name, [&value] { return json(value); });
}

Option& Tool::choiceOf(const std::string& name, const std::vector<std::string>& names, std::size_t current,
                       std::function<void(std::size_t)> set, const std::string& help) {
  const auto word = std::make_shared<std::string>(names[current]);
  CLI::Option* option = state_->app.add_option_function<std::string>(
      name,
      [=](const std::string& given) {
        *word = given;
        set(static_cast<std::size_t>(std::find(names.begin(), names.end(), given) - names.begin()));
      },
      help);
  const std::string all = fmt::format("{}", fmt::join(names, "|"));
  option->default_str(*word)->type_name(all)->check(CLI::Validator(
      [names, all](std::string& given) {
        if (std::find(names.begin(), names.end(), given) != names.end()) return std::string();
        const std::string near = nearestName(given, names);
        return "'" + given + "' is not one of " + all + (near.empty() ? "" : "; did you mean '" + near + "'?");
      },
      "", "choice"));
  return state_->add(option, name, [word] { return json(*word); });
}

CLI::App& Tool::parser() { return state_->app; }
void Tool::pointTo(const std::string& line, const std::vector<std::string>& options) {
  state_->elsewhere.emplace_back(line, options);
}
void Tool::usesSeed() { state_->uses_seed = true; }
void Tool::addCheck(std::function<void()> check) { state_->checks.push_back(std::move(check)); }
void Tool::addLateCheck(std::function<void()> check) { state_->late_checks.push_back(std::move(check)); }
void Tool::addReplaceCheck(std::function<void()> check) { state_->replace_checks.push_back(std::move(check)); }
bool Tool::skipUnchanged() const { return state_->skip_unchanged; }
const std::string& Tool::name() const { return state_->info.name; }
bool Tool::quiet() const { return state_->quiet; }
bool Tool::verbose() const { return state_->verbose; }
bool Tool::wantsJson() const { return state_->json_result; }
bool Tool::force() const { return state_->force; }
bool Tool::trust() const { return state_->trust; }
int Tool::threads() const { return state_->threads > 0 ? state_->threads : tbb::info::default_concurrency(); }
void Tool::setResult(const nlohmann::json& result) { state_->result = result; }
void Tool::setExitCode(ErrorCode code) { state_->exit_code = code; }
void Tool::addInput(const std::string& path) { state_->inputs.push_back(path); }
void Tool::addOutput(const std::string& path) { state_->outputs.push_back(path); }
void Tool::setRecord(std::function<formats::Provenance()> record) { state_->record = std::move(record); }
void Tool::makesMore() { state_->makes_more = true; }
const std::vector<std::string>& Tool::outputPaths() const { return state_->outputs; }
std::string Tool::generator() const { return state_->info.name + " " GLINT_VERSION; }

std::vector<std::string> Tool::readPaths() const {
  std::vector<std::string> paths = state_->inputs;
  if (const CLI::Option* config = state_->app.get_config_ptr(); config != nullptr && config->count() > 0)
    paths.push_back(config->as<std::string>());
  return paths;
}

std::uint64_t Tool::seed() const {
  if (!state_->uses_seed) throw std::logic_error(name() + " takes a seed that it does not record");
  return state_->seed;
}

bool Tool::limitsMemory() const { return state_->max_memory > 0; }

std::uint64_t Tool::maxMemory() const { return state_->max_memory > 0 ? state_->max_memory : availableMemory(); }

void Tool::requireMemory(double bytes, const std::string& what, const std::string& remedy) const {
  constexpr double kAlwaysTried = 32 << 20;  // what a system has left is a guess, and so little may still be found
  const auto most = static_cast<double>(maxMemory());
  if (bytes <= (state_->max_memory > 0 ? most : std::max(most, kAlwaysTried))) return;
  throw Error(ErrorCode::failed, "memory.limit", "", "",
              fmt::format("{} would take {} of memory, and {} may be used", what, memoryText(bytes), memoryText(most)),
              remedy + ", or raise --max-memory where the machine has more");
}

bake::ProgressFn Tool::progress(const std::string& stage) {
  State& s = *state_;
  s.reporter.reset();
  if (s.progress_mode == ProgressMode::none || (s.quiet && s.progress_mode == ProgressMode::automatic)) return {};
  s.reporter = std::make_unique<ProgressReporter>(s.progress_mode, s.info.name, stage);
  return [reporter = s.reporter.get()](std::size_t done, std::size_t total) { reporter->update(done, total); };
}

void Tool::print(const std::string& text) {
  if (wantsJson()) return;
  state_->clearProgress();
  writeStdout(text);
}

void Tool::summary(const std::string& text) {
  if (verbose()) print(text);
}

void Tool::warn(const std::string& text) {
  const std::string line = shownText(text, kMostWarning);
  state_->warnings.push_back(line);
  if (quiet()) return;
  state_->clearProgress();
  writeStderr(fmt::format("{}: warning: {}\n", name(), line));
}

std::string Tool::commandJson() const {
  nlohmann::json command = nlohmann::json::object();
  for (std::size_t i = 0; i < state_->options.size(); ++i) {
    const Option& option = state_->options[i];
    if (option.recorded_ && (!option.only_if_given_ || option.given()))
      command[state_->recorders[i].first] = state_->recorders[i].second();
  }
  if (state_->uses_seed) command["seed"] = state_->seed;
  return command.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

formats::Provenance Tool::provenance() const { return provenance(state_->inputs); }

formats::Provenance Tool::provenance(const std::vector<std::string>& inputs) const {
  formats::Provenance provenance{generator(), commandJson(), {}};
  for (const std::string& path : inputs) {
    const std::string name = std::filesystem::path(path).filename().string();
    requireText(path, name);
    provenance.inputs.push_back({name, formats::hashFile(path)});
  }
  return provenance;
}

void Tool::refuseUnknownOptions() const {
  const CLI::App& app = state_->app;
  std::vector<std::string> unknown;
  for (const std::string& word : app.remaining())
    if (word.size() >= 2 && word[0] == '-') unknown.push_back(word.substr(0, word.find('=')));
  if (unknown.empty()) return;
  for (const auto& [line, options] : state_->elsewhere) {
    const auto moved = std::find_first_of(unknown.begin(), unknown.end(), options.begin(), options.end());
    if (moved != unknown.end())
      throw Error(ErrorCode::usage, "cli.unknown_option", "", "", "unknown option " + *moved,
                  "it is an option of another command: " + line);
  }
  std::vector<std::string> known;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& long_name : option->get_lnames()) known.push_back("--" + long_name);
  const std::string near = nearestName(unknown.front(), known);
  throw Error(ErrorCode::usage, "cli.unknown_option", "", "", "unknown option " + unknown.front(),
              (near.empty() ? "" : "did you mean " + near + "? ") + "see " + name() + " --help");
}

bool Tool::parse(int argc, char** argv) {
  CLI::App& app = state_->app;
  try {
    // CLI11 takes "-.5" for an option.
    std::vector<std::string> words(argv + 1, argv + argc);
    for (std::string& word : words)
      if (word.size() > 2 && word.starts_with("-.") && std::isdigit(static_cast<unsigned char>(word[2]))) word.insert(1, "0");
    std::reverse(words.begin(), words.end());
    app.parse(std::move(words));
    return true;
  } catch (const CLI::CallForHelp&) {
    writeStdout(app.help());
    return false;
  } catch (const CLI::CallForVersion&) {
    writeStdout(generator() + "\n");
    return false;
  } catch (const CLI::FileError& error) {
    throw Error(ErrorCode::io, "cli.config", "", "", error.what(), "check the name given to --config");
  } catch (const CLI::ParseError& error) {
    // A misspelt name is the cause of most other complaints ("--output is required"), so it is reported first.
    refuseUnknownOptions();
    throw Error(ErrorCode::usage, "cli.usage", "", "", error.what(), "see " + name() + " --help");
  }
}

int Tool::work(const std::function<void()>& body) {
  State& s = *state_;
  for (const auto& check : s.checks) check();
  if (s.skip_unchanged && s.outputs.empty())
    throw Error(ErrorCode::usage, "cli.skip_unchanged", "", "--skip-unchanged", "nothing is made that could be left alone",
                "ask for an output file, or leave out --skip-unchanged");
  if (s.app.get_option("--depfile")->count() > 0) {
    if (s.outputs.empty())
      throw Error(ErrorCode::usage, "cli.depfile", "", "--depfile", "nothing is made that could depend on anything",
                  "ask for an output file, or leave out --depfile");
    checkOutput(*this, s.depfile, OutputFormat::depfile);
    (void)makeDepfile(s.outputs, readPaths());  // names that Make cannot express are refused before the work
  }
  for (const auto& check : s.late_checks) check();
  if (s.max_memory > 0) limitMemory(s.max_memory);
  limitThreads(threads());
  if (s.skip_unchanged && isUnchanged()) {
    writeDepfile();
    reportUnchanged();
    return 0;
  }
  for (const auto& check : s.replace_checks) check();
  body();
  s.reporter.reset();
  writeDepfile();
  const int code = s.exit_code ? static_cast<int>(*s.exit_code) : 0;
  if (s.json_result) {
    const char* status = s.exit_code ? codeName(*s.exit_code) : "ok";
    writeStdout(dump({{"schema", kJsonSchema},
                      {"tool", s.info.name},
                      {"version", GLINT_VERSION},
                      {"status", status},
                      {"result", s.result},
                      {"warnings", s.warnings}}) +
                "\n");
  }
  flushStdout();
  return code;
}

void Tool::writeDepfile() const {
  const State& s = *state_;
  if (s.app.get_option("--depfile")->count() > 0) writeTextFile(s.depfile, makeDepfile(s.outputs, readPaths()));
}

bool Tool::isUnchanged() const {
  const State& s = *state_;
  if (s.makes_more) return false;
  if (s.record) {
    const formats::Provenance record = s.record();
    return std::all_of(s.outputs.begin(), s.outputs.end(), [&](const std::string& output) {
      return isMadeBy(
          output, record, [&] { return record; }, s.trust);
    });
  }
  const formats::Provenance run{generator(), commandJson(), {}};
  return std::all_of(s.outputs.begin(), s.outputs.end(), [&](const std::string& output) {
    return isMadeBy(
        output, run, [this] { return provenance(); }, s.trust);
  });
}

void Tool::reportUnchanged() const {
  const State& s = *state_;
  if (!s.quiet)
    for (const std::string& output : s.outputs)
      writeStderr(fmt::format("{}: {}: unchanged\n", s.info.name, escapedText(output)));
  if (s.json_result) {
    writeStdout(dump({{"schema", kJsonSchema},
                      {"tool", s.info.name},
                      {"version", GLINT_VERSION},
                      {"status", "unchanged"},
                      {"outputs", s.outputs},
                      {"warnings", s.warnings}}) +
                "\n");
  }
  flushStdout();
}

int Tool::fail(const Error& error) {
  State& s = *state_;
  s.reporter.reset();
  writeStderr(fmt::format("{}: error: {}\n", s.info.name, error.what()));
  if (s.json_result) printFailure(error);
  return static_cast<int>(error.code());
}

void Tool::printFailure(const Error& error) const {
  const json document = {{"schema", kJsonSchema}, {"tool", state_->info.name},       {"version", GLINT_VERSION},
                         {"status", "error"},     {"error", json(errorJson(error))}, {"warnings", state_->warnings}};
  try {
    writeStdout(dump(document) + "\n");
    flushStdout();
  } catch (const Error&) {
    // The exit code is that of the first error.
  }
}

int Tool::run(int argc, char** argv, const std::function<void()>& body) {
  openStandardStreams();
  const SignalScope signals;
  const auto fail_without_memory = [&]() noexcept {
    try {
      return fail({ErrorCode::failed, "memory", "", "", "out of memory", kMemoryRemedy});
    } catch (const std::bad_alloc&) {
      return static_cast<int>(ErrorCode::failed);  // not even for the message; the code says it
    }
  };
  try {
    // Parsing stops at the first error, possibly before it reads --json.
    for (int i = 1; i < argc; ++i) state_->json_result |= std::string(argv[i]) == "--json";
    addStandardOptions();  // last, so that the help begins with the tool's own options
    if (parse(argc, argv)) return work(body);
    flushStdout();
    return 0;
  } catch (const std::bad_alloc&) {
    return fail_without_memory();
  } catch (const Error& error) {
    return memoryRanOut() ? fail_without_memory() : fail(error);  // a library may have given another reason
  } catch (const std::system_error& error) {                      // includes std::filesystem::filesystem_error
    if (memoryRanOut() || error.code() == std::errc::not_enough_memory) return fail_without_memory();
    return fail({ErrorCode::io, "system", "", "", error.what()});
  } catch (const std::exception& error) {
    if (memoryRanOut()) return fail_without_memory();
    return fail({ErrorCode::failed, "internal", "", "", error.what(), "please report this as a defect"});
  }
}

}  // namespace glint::apps
