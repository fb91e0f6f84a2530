#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "common/option.h"
#include "glint/bake/common/progress.h"
#include "glint/formats/provenance.h"
#include "glint/model/error.h"

namespace CLI {
class App;
}  // namespace CLI

namespace glint::apps {

class ProgressReporter;

/// The texts of a tool's `--help`.
struct ToolInfo {
  std::string name;        ///< "glint-pyramid"
  std::string summary;     ///< one or two sentences: what it reads and what it makes
  std::string example;     ///< one command line that works, shown at the end of the help text
  std::string notes = {};  ///< a longer explanation, such as the form of a file; shown before the example
};

/// A command-line program: declares the flags that every tool shares, parses, runs the work, and exits.
///
/// Shared flags: --threads --max-memory --seed --json --progress --quiet --verbose --force --skip-unchanged --trust --depfile --config
/// --version --help.
/// Declare inputs and outputs with the mix-ins of files.h and parameters with option(), flag() and choice(); then
/// `return tool.run(argc, argv, [&] { ... });`. References passed in must outlive run().
///
/// With --json, stdout holds exactly one JSON document: {"schema", "tool", "version", "status": "ok", "result", "warnings"}, or
/// on failure {..., "status": "error", "error": {"code", "rule", "path", "object", "message", "remedy"}}. The message for
/// people is on stderr in both cases: one line, whatever goes wrong. A run that --skip-unchanged skips has the status "unchanged", and
/// "outputs" in place of a result.
///
/// Signals that end the process remove temporary files first (signals.h). A failure to write stdout is an error (io); a failure
/// to write stderr is ignored.
class Tool {
 public:
  explicit Tool(ToolInfo info);
  ~Tool();
  Tool(const Tool&) = delete;
  Tool& operator=(const Tool&) = delete;

  /// Sets the heading of the options that are declared next, in the help text. The first heading is kOptions.
  void section(const std::string& title);
  static constexpr const char* kOptions = "Options";

  /// Declares an option or, when `name` has no dash, a positional argument. `value` holds the default, and the help shows it. The
  /// help does not show a default that is empty or out of the option's range: such a default means "not given".
  /// T: int, std::uint64_t, float, double, std::string, or std::vector of int, float or std::string (given as a,b,c).
  /// Numbers are read by parseNumber (numbers.h): those that are not finite, or that T cannot hold, are a usage error.
  template <class T>
  Option& option(const std::string& name, T& value, const std::string& help);

  /// Declares a flag without a value.
  Option& flag(const std::string& name, bool& value, const std::string& help);

  /// Declares an option that takes one of a few words.
  template <class E>
  Option& choice(const std::string& name, E& value, std::initializer_list<std::pair<const char*, E>> words,
                 const std::string& help) {
    std::vector<std::string> names;
    std::vector<E> values;
    std::size_t current = 0;
    for (const auto& [word, word_value] : words) {
      if (word_value == value) current = names.size();
      names.emplace_back(word);
      values.push_back(word_value);
    }
    return choiceOf(
        name, names, current, [&value, values](std::size_t index) { value = values[index]; }, help);
  }

  /// The parser, for what the functions above do not cover. Options declared here are not in the `command` record.
  CLI::App& parser();

  /// Names options that belong to another command of the program. Who gives one of them here is pointed to that command.
  /// @param line  how the other command is called
  void pointTo(const std::string& line, const std::vector<std::string>& options);

  /// Declares that the result depends on --seed: `command` records it. Call before run().
  void usesSeed();

  /// Adds a check that runs after parsing and before the work. It throws glint::Error.
  void addCheck(std::function<void()> check);

  /// Adds a check that runs when every other has run, so that all inputs and outputs are known.
  void addLateCheck(std::function<void()> check);

  /// Adds a check that runs last, and only if the outputs are made: not where --skip-unchanged leaves them.
  void addReplaceCheck(std::function<void()> check);
  bool skipUnchanged() const;

  /// Parses, checks, works, writes the depfile and the JSON result; turns every exception into a message and an exit code.
  /// @return exit code: 0 ok, or the value of the ErrorCode
  int run(int argc, char** argv, const std::function<void()>& work);

  // For the work.

  const std::string& name() const;
  bool quiet() const;
  bool verbose() const;
  bool wantsJson() const;
  bool force() const;
  /// Value of --trust: hashes and values of assets are not checked. Open inputs with openInput() (input_asset.h).
  bool trust() const;
  /// Value of --max-memory in bytes, or the memory that the process may still take (memory.h).
  std::uint64_t maxMemory() const;
  /// Whether --max-memory was given.
  bool limitsMemory() const;
  /// Refuses work that needs more than maxMemory(); without --max-memory, work of up to 32 MB is always tried. Call it before the
  /// work, with an estimate that is no smaller than the need.
  /// @param what    "8192 NDF images"; the message says how much they take
  /// @param remedy  an option that makes the need smaller: "give a larger --stride"
  /// @throws Error failed
  void requireMemory(double bytes, const std::string& what, const std::string& remedy) const;
  /// Value of --threads, or the number of the processor's threads. oneTBB is already limited to it.
  int threads() const;
  /// Value of --seed.
  /// @throws std::logic_error if usesSeed() was not called: the record of the run would lack the seed
  std::uint64_t seed() const;
  /// Progress of a named stage, as --progress asks. The reporter lives until the next call or the end of the run.
  bake::ProgressFn progress(const std::string& stage);
  /// Sets the result that --json prints. An object whose keys are snake_case, with units in their names.
  void setResult(const nlohmann::json& result);
  /// Prints text that is the tool's result on stdout; nothing with --json.
  void print(const std::string& text);
  /// Prints a summary on stdout if --verbose was given, and nothing with --json.
  void summary(const std::string& text);
  /// Prints a warning on stderr unless --quiet was given; it is also in the JSON result.
  void warn(const std::string& text);
  /// Makes run() return this code although nothing failed, for comparisons (ErrorCode::differs).
  void setExitCode(ErrorCode code);

  /// Adds a file that the result was read from to `inputs` and to the depfile. The mix-ins of files.h call this.
  void addInput(const std::string& path);
  /// Adds a file that the run makes to the targets of the depfile. The mix-ins of files.h call this.
  void addOutput(const std::string& path);
  /// Declares that the run writes files that addOutput() does not name before the work, so that --skip-unchanged cannot tell whether
  /// they are there: nothing is skipped.
  void makesMore();
  /// Declares that outputs have another record than provenance(), which --skip-unchanged is to look for.
  void setRecord(std::function<formats::Provenance()> record);
  /// Files that the run reads: the inputs declared so far, and the configuration file.
  std::vector<std::string> readPaths() const;
  /// Outputs declared so far.
  const std::vector<std::string>& outputPaths() const;

  /// "glint-pyramid 0.1.0".
  std::string generator() const;
  /// JSON object of every recorded parameter, defaults included, keys sorted.
  std::string commandJson() const;
  /// The record of this run in an asset: generator, command, and the name and hash of every input. Names are without folders, so
  /// that outputs do not depend on where a build runs. Reads the inputs.
  /// @throws Error io if an input cannot be read
  formats::Provenance provenance() const;
  /// The same for a part of the run that reads only these files.
  formats::Provenance provenance(const std::vector<std::string>& inputs) const;

 private:
  struct State;

  Option& choiceOf(const std::string& name, const std::vector<std::string>& names, std::size_t current,
                   std::function<void(std::size_t)> set, const std::string& help);
  void addStandardOptions();
  /// @return false when --help or --version was answered
  bool parse(int argc, char** argv);
  /// Throws Error usage if words were left over that look like options.
  void refuseUnknownOptions() const;
  int work(const std::function<void()>& work);
  /// Whether every output is an asset that this run would only make again.
  bool isUnchanged() const;
  /// Tells of a run that was skipped.
  void reportUnchanged() const;
  /// Writes the depfile, if one is asked for.
  void writeDepfile() const;
  int fail(const Error& error);
  void printFailure(const Error& error) const;

  std::unique_ptr<State> state_;
};

}  // namespace glint::apps
