#include "cli/command_line.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <optional>

namespace fieldmark::cli {
namespace {

std::string fault_of_number(const std::string& text) {
  double value = 0;
  if (CLI::detail::lexical_cast(text, value) && !std::isfinite(value))
    return "expected a finite number, got " + text;
  return "";
}

std::string fault_of_unsigned(const std::string& text) {
  return text.starts_with('-') ? "expected a whole number from 0, got " + text : "";
}

}  // namespace

Option Option::required() { return option_->required(), *this; }
Option Option::type_name(const std::string& name) { return option_->type_name(name), *this; }
Option Option::default_str(const std::string& text) { return option_->default_str(text), *this; }
Option Option::group(const std::string& name) { return option_->group(name), *this; }
// The description of a check would stand twice in help texts, which name the range in words.
Option Option::whole(std::int64_t low, std::int64_t high) {
  return option_->check(CLI::Range(low, high).description("")), *this;
}
Option Option::real(double low, double high) {
  return option_->check(CLI::Range(low, high).description("")), *this;
}
Option Option::one_of(const std::vector<std::string>& names) {
  return option_->check(CLI::IsMember(names).description("")), *this;
}
Option Option::one_of(std::initializer_list<int> values) {
  return option_->check(CLI::IsMember(std::vector<int>(values)).description("")), *this;
}
Option Option::check(std::function<std::string(const std::string&)> fault) {
  const auto checked = [fault = std::move(fault)](std::string& value) { return fault(value); };
  return option_->check(CLI::Validator(checked, "")), *this;
}
Option Option::needs(Option other) { return option_->needs(other.option_), *this; }
Option Option::excludes(Option other) { return option_->excludes(other.option_), *this; }
Option Option::delimiter(char character) { return option_->delimiter(character), *this; }
Option Option::one_value() { return option_->allow_extra_args(false), *this; }
std::size_t Option::count() const { return option_->count(); }

template <class T>
Option CommandLine::add_option(const std::string& name, T& value, const std::string& help) {
  Option option(app_->add_option(name, value, help));
  constexpr bool texts = std::is_same_v<T, std::string> || std::is_same_v<T, std::vector<std::string>>;
  if constexpr (!texts) option.check(fault_of_number);
  if constexpr (std::is_unsigned_v<T>) option.check(fault_of_unsigned);
  return option;
}
template Option CommandLine::add_option(const std::string&, std::string&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::vector<std::string>&, const std::string&);
template Option CommandLine::add_option(const std::string&, double&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::optional<double>&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::optional<std::int64_t>&, const std::string&);
template Option CommandLine::add_option(const std::string&, int&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::int64_t&, const std::string&);
template Option CommandLine::add_option(const std::string&, std::uint64_t&, const std::string&);

Option CommandLine::add_flag(const std::string& name, bool& value, const std::string& help) {
  return Option(app_->add_flag(name, value, help));
}

Option CommandLine::option(const std::string& name) { return Option(app_->get_option(name)); }

CommandLine CommandLine::add_subcommand(const std::string& name, const std::string& help) {
  app_->require_subcommand(1);
  app_->fallthrough();
  return CommandLine(*app_->add_subcommand(name, help)->fallthrough());
}

bool CommandLine::parsed() const { return app_->parsed(); }

}  // namespace fieldmark::cli
