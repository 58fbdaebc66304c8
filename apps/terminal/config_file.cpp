// SPDX-License-Identifier: Apache-2.0
#include "apps/terminal/config_file.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "apps/words/option_words.h"
#include "apps/words/usage.h"
#include "core/words.h"

namespace polarscan {
namespace {

constexpr const char* kSpaces = " \t\r";

// One line of TOML, read from the front.
class TomlLine {
 public:
  explicit TomlLine(std::string text) : text_(std::move(text)) {}

  bool AtEnd() {
    at_ = std::min(text_.find_first_not_of(kSpaces, at_), text_.size());
    return at_ == text_.size() || text_[at_] == '#';
  }
  // Whether the next character is this one; then it is behind us.
  bool Takes(char c) {
    if (AtEnd() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  // A name or a value: between quotes, or up to what cannot belong to it.
  std::string Word() {
    if (AtEnd()) throw CLI::ConfigError("it ends too early");
    const char quote = text_[at_];
    if (quote != '"' && quote != '\'') {
      const std::size_t begin = at_;
      at_ = std::min(text_.find_first_of(" \t\r=#[],", at_), text_.size());
      if (at_ == begin)
        throw CLI::ConfigError(fmt::format("'{}' is not expected there", Excerpt(text_.substr(at_, 1))));
      return text_.substr(begin, at_ - begin);
    }
    std::string word;
    for (++at_; at_ < text_.size() && text_[at_] != quote; ++at_) {
      if (quote == '"' && text_[at_] == '\\' && at_ + 1 < text_.size()) ++at_;
      word += text_[at_];
    }
    if (at_ == text_.size()) throw CLI::ConfigError("a text without its closing quote");
    ++at_;
    return word;
  }
  void ExpectEnd() {
    if (!AtEnd())
      throw CLI::ConfigError(fmt::format("'{}' is not expected there", Excerpt(text_.substr(at_))));
  }

 private:
  std::string text_;
  std::size_t at_ = 0;
};

// "calibrate.dark" below a command.
const CLI::App& CommandAt(const CLI::App& above, const std::string& path) {
  const CLI::App* command = &above;
  for (const std::string& name : CLI::detail::split(path, '.')) {
    const std::vector<const CLI::App*> below = CommandsOf(*command);
    const auto found = std::ranges::find(below, name, &CLI::App::get_name);
    if (found == below.end())
      throw CLI::ConfigError(fmt::format("[{}]: {}", Excerpt(path), NoSuchCommand(*command, Excerpt(name))));
    command = *found;
  }
  return *command;
}

// The rest of a line that begins with [.
std::string Section(TomlLine& line) {
  const std::string path = line.Word();
  if (!line.Takes(']')) throw CLI::ConfigError("a [section] without its ]");
  line.ExpectEnd();
  return path;
}

// NAME = VALUE, or a list of values on that line.
CLI::ConfigItem Setting(TomlLine& line) {
  CLI::ConfigItem item;
  item.name = line.Word();
  if (!line.Takes('=')) throw CLI::ConfigError("an option is set as NAME = VALUE");
  if (!line.Takes('[')) {
    item.inputs = {line.Word()};
  } else {
    while (!line.Takes(']')) {
      if (line.AtEnd()) throw CLI::ConfigError("a list ends with ] on the line where it begins");
      item.inputs.push_back(line.Word());
      line.Takes(',');
    }
  }
  line.ExpectEnd();
  return item;
}

// That as many values are there as the option takes, and yes or no where it takes those.
void RequireFitting(const CLI::Option& option, const std::vector<std::string>& values) {
  static const std::vector<std::string> kYesOrNo = {"true", "false", "yes", "no", "on", "off", "1", "0"};
  const int most = option.get_items_expected_max();
  if (most <= 1 && values.size() != 1)
    throw CLI::ConfigError(fmt::format("{} takes one value", option.get_name()));
  if (most == 0 && std::ranges::find(kYesOrNo, LowerCase(values[0])) == kYesOrNo.end())
    throw CLI::ConfigError(
        fmt::format("{} is true or false, not '{}'", option.get_name(), Excerpt(values[0])));
}

// Where an option stands that the program itself does not have: ". It belongs below [mesh]".
std::string SectionsOf(const CLI::App& program, const std::string& option) {
  std::vector<std::string> sections;
  for (const CLI::App* command : CommandsOf(program))
    if (command->get_option_no_throw("--" + option)) sections.push_back("[" + command->get_name() + "]");
  return sections.empty()
             ? ""
             : fmt::format(". It belongs below the section of its command: {}", fmt::join(sections, ", "));
}

}  // namespace

std::vector<CLI::ConfigItem> ConfigFile::from_config(std::istream& file) const {
  const auto name = program_.get_config_ptr()->as<std::string>();
  std::vector<CLI::ConfigItem> settings;
  const CLI::App* command = &program_;
  std::map<const CLI::Option*, int> lines;  // where each was set
  int number = 0;
  for (std::string text; std::getline(file, text);) {
    const std::string place = fmt::format("{}, line {}", name, ++number);
    if (number == 1 && text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);  // as Windows' editors begin
    try {
      TomlLine line(text);
      if (line.AtEnd()) continue;
      if (line.Takes('[')) {
        command = &CommandAt(program_, Section(line));
        continue;
      }
      CLI::ConfigItem item = Setting(line);
      const std::size_t dot = item.name.rfind('.');
      const CLI::App& owner =
          dot == std::string::npos ? *command : CommandAt(*command, item.name.substr(0, dot));
      item.name.erase(0, dot + 1);  // npos + 1 is 0
      const CLI::Option* option = owner.get_option_no_throw("--" + item.name);
      if (!option || !option->get_configurable())
        throw CLI::ConfigError(NoSuchOption(owner, "--" + Excerpt(item.name)) +
                               SectionsOf(program_, item.name));
      RequireFitting(*option, item.inputs);
      if (const auto [first, is_new] = lines.emplace(option, number); !is_new)
        throw CLI::ConfigError(
            fmt::format("{} was set in line {} already", Excerpt(item.name), first->second));
      item.parents = PathOf(owner);
      item.parents.erase(item.parents.begin());  // the program
      places_[option->get_name()] = place;
      settings.push_back(std::move(item));
    } catch (const CLI::ConfigError& error) {
      throw CLI::ConfigError(fmt::format("{}: {}", place, error.what()));
    }
  }
  return settings;
}

std::string ConfigFile::PlaceOf(const std::string& option) const {
  const auto found = places_.find(option);
  return found == places_.end() ? "" : found->second;
}

}  // namespace polarscan
