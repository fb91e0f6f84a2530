#include "glint-farm/run_report.h"

#include <fmt/format.h>

#include <algorithm>

#include "glint/model/memory_text.h"

namespace glint::apps {
namespace {

using Json = nlohmann::ordered_json;

Json lineOf(const EntryTry& last, int tries) {
  Json line = {{"tries", tries},
               {"exit_code", last.exit_code},
               {"wall_s", last.wall_s},
               {"cpu_s", last.cpu_s},
               {"peak_bytes", last.peak_bytes}};
  if (!last.error.is_null()) line["error"] = last.error;
  return line;
}

}  // namespace

RunReport::RunReport(Tool& tool, EntryRecords& records, const std::string& log, std::size_t entries)
    : tool_(tool), records_(records), entries_(entries), progress_(tool.progress("assets")) {
  if (!log.empty()) log_.emplace(log);
}

void RunReport::add(const ManifestEntry& entry, const char* status, Json more, bool recorded, bool done) {
  Json line = {{"key", entry.key}, {"output", entry.output}, {"status", status}};
  line.update(more);
  if (recorded) records_.add(entry, line, done);
  const std::lock_guard lock(mutex_);
  if (log_) log_->append({line});
  ++counts_[status];
  ++ended_;
  if (progress_) progress_(ended_, entries_);
}

void RunReport::known(const ManifestEntry& entry) { add(entry, "known", Json::object(), false, true); }

void RunReport::made(const ManifestEntry& entry, const EntryTry& last, int tries) {
  const bool is_made = last.outcome == EntryTry::Outcome::made;
  // With --trust a program has not read what it left alone: a record would call damaged assets whole.
  add(entry, is_made ? "made" : "unchanged", lineOf(last, tries), is_made || !tool_.trust(), true);
  const std::lock_guard lock(mutex_);
  program_s_ += last.wall_s, cpu_s_ += last.cpu_s;
  peak_bytes_ = std::max(peak_bytes_, last.peak_bytes);
}

void RunReport::failed(const ManifestEntry& entry, const EntryTry& last, int tries) {
  add(entry, "failed", lineOf(last, tries), true, false);
  const std::lock_guard lock(mutex_);
  program_s_ += last.wall_s, cpu_s_ += last.cpu_s;
  const auto message = last.error.value("message", std::string());
  failures_.push_back({{"output", entry.output}, {"rule", last.error.value("rule", std::string())}, {"message", message}});
  tool_.warn(entry.output + " was not made: " + message);
}

void RunReport::notMade(const ManifestEntry& entry, const ManifestEntry& needed) {
  add(entry, "not_made",
      {{"error",
        {{"code", "failed"},
         {"rule", "farm.needs"},
         {"path", entry.output},
         {"object", ""},
         {"message", "needs " + needed.output + ", which was not made"},
         {"remedy", "see why that one failed, then run again"}}}},
      true, false);
}

nlohmann::json RunReport::json() const {
  const auto count = [&](const char* status) { return counts_.contains(status) ? counts_.at(status) : 0; };
  return {{"entries", entries_},       {"known", count("known")},
          {"made", count("made")},     {"unchanged", count("unchanged")},
          {"failed", count("failed")}, {"not_made", count("not_made")},
          {"program_s", program_s_},   {"cpu_s", cpu_s_},
          {"peak_bytes", peak_bytes_}, {"failures", failures_}};
}

std::string RunReport::text() const {
  std::string text = fmt::format("{} assets:", entries_);
  for (const auto& [status, number] : counts_)
    text += fmt::format(" {} {},", number, status == "not_made" ? "not made" : status);
  return text +
         fmt::format(" {:.1f} s of programs, {} of memory at most\n", program_s_, memoryText(static_cast<double>(peak_bytes_)));
}

}  // namespace glint::apps
