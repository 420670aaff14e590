#pragma once
#include <cstdlib>
#include <optional>
#include <string>

/// Sets an environment variable, or unsets it (null), until the end of the scope.
struct EnvironmentVariable {
  std::string name;
  std::optional<std::string> before;
  EnvironmentVariable(const char* variable, const char* value) : name(variable) {
    if (const char* old = std::getenv(variable)) before = old;
    set(value);
  }
  EnvironmentVariable(const EnvironmentVariable&) = delete;
  EnvironmentVariable& operator=(const EnvironmentVariable&) = delete;
  ~EnvironmentVariable() { set(before ? before->c_str() : nullptr); }

 private:
  void set(const char* value) const {
    if (value)
      ::setenv(name.c_str(), value, 1);
    else
      ::unsetenv(name.c_str());
  }
};
