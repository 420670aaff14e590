#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/tools/bench/line_process.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "timing.h"

namespace fieldmark::bench {
namespace {

constexpr std::size_t kLastLines = 5;
constexpr std::size_t kLongestLine = 1 << 20;  // characters: a program that writes longer lines is stopped

std::string ending(int status) {
  return status < 0            ? "closed its output"
         : WIFSIGNALED(status) ? "was killed by signal " + std::to_string(WTERMSIG(status))
                               : "ended with exit code " + std::to_string(WEXITSTATUS(status));
}

std::string_view name_of(std::string_view entry) { return entry.substr(0, entry.find('=')); }

// Returns this process's environment with entries replaced or added.
std::vector<std::string> merged_environment(const std::vector<std::string>& ours) {
  std::vector<std::string> all = ours;
  for (char** e = environ; *e; ++e)
    if (std::none_of(ours.begin(), ours.end(), [&](const auto& o) { return name_of(o) == name_of(*e); }))
      all.emplace_back(*e);
  return all;
}

std::vector<char*> pointers(std::vector<std::string>& strings) {
  std::vector<char*> out;
  out.reserve(strings.size() + 1);
  for (std::string& s : strings) out.push_back(s.data());
  out.push_back(nullptr);
  return out;
}

}  // namespace

LineProcess::LineProcess(const std::vector<std::string>& command, const std::vector<std::string>& environment,
                         double limit_seconds)
    : program_(command.empty() ? "" : command[0]), limit_seconds_(limit_seconds) {
  if (program_.empty() || !(limit_seconds > 0))
    throw ValueError("[LineProcess] command must not be empty and limit_seconds above 0, got '" + program_ +
                     "' and " + number_text(limit_seconds));
  // One socket for both directions: unlike a pipe, writing to it raises no signal after its reader has gone.
  std::array<int, 2> ends{-1, -1};
  errors_ = std::tmpfile();
  int error = errors_ ? 0 : errno;
  if (!error && ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) error = errno;
  if (!error) {
    std::vector<std::string> words = command, variables = merged_environment(environment);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    for (const int fd : {0, 1}) posix_spawn_file_actions_adddup2(&actions, ends[1], fd);
    posix_spawn_file_actions_adddup2(&actions, ::fileno(errors_), 2);
    error = ::posix_spawnp(&pid_, program_.c_str(), &actions, nullptr, pointers(words).data(),
                           pointers(variables).data());
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
    socket_ = ends[0];
  }
  if (!error) return;
  if (socket_ >= 0) ::close(socket_);
  if (errors_) std::fclose(errors_);
  throw IoError(program_ + ": cannot be started (" + std::strerror(error) + ")");
}

LineProcess::~LineProcess() {
  kill_and_wait();
  ::close(socket_);
  std::fclose(errors_);
}

void LineProcess::kill_and_wait() {
  if (pid_ < 0) return;
  ::kill(pid_, SIGKILL);
  while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
}

void LineProcess::write_line(std::string_view line) {
  const std::string text = std::string(line) + "\n";
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t n = ::send(socket_, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
    if (n < 0 && errno != EINTR) return;
    if (n > 0) sent += static_cast<std::size_t>(n);
  }
}

// Appends the program's output to received_; returns false once the program has closed it.
bool LineProcess::receive(double until, const char* what, const std::function<void()>& tick) {
  constexpr double kTick = 0.1;  // seconds
  for (;;) {
    if (tick) tick();
    const double left = until - now(), wait_for = tick ? std::min(left, kTick) : left;
    if (left <= 0) {
      kill_and_wait();
      char text[60];
      std::snprintf(text, sizeof text, ": %s within %g s", what, limit_seconds_);
      throw IoError(program_ + text + last_words());
    }
    pollfd wait{socket_, POLLIN, 0};
    const int ready = ::poll(&wait, 1, static_cast<int>(std::min(wait_for * 1000 + 1, 1e9)));
    if (ready == 0 || (ready < 0 && errno == EINTR)) continue;
    std::array<char, 4096> part;
    const ssize_t n = ::read(socket_, part.data(), part.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    received_.append(part.data(), static_cast<std::size_t>(n));
    return true;
  }
}

std::string LineProcess::read_line() {
  const double until = now() + limit_seconds_;
  for (;;) {
    if (const auto end = received_.find('\n'); end != std::string::npos) {
      std::string line = received_.substr(0, end);
      received_.erase(0, end + 1);
      return line;
    }
    if (received_.size() > kLongestLine) {
      kill_and_wait();
      throw IoError(program_ + ": an answer without an end" + last_words());
    }
    if (receive(until, "no answer", {})) continue;
    const std::string how = ending(status_at_end(until, {}));
    throw IoError(program_ + ": " + how + " before it answered" + last_words());
  }
}

void LineProcess::finish(const std::function<void()>& tick) {
  ::shutdown(socket_, SHUT_WR);
  const double until = now() + limit_seconds_;
  do received_.clear();
  while (receive(until, "did not end", tick));
  const int status = status_at_end(until, tick);
  if (tick) tick();  // an interruption comes before the failure that it causes
  if (status != 0) throw IoError(program_ + ": " + ending(status) + last_words());
}

// Waits for a program that closed its output. Returns its waitpid() status, or -1 if the time is up and it is
// killed.
int LineProcess::status_at_end(double until, const std::function<void()>& tick) {
  int status = 0;
  pid_t ended = 0;
  while ((ended = ::waitpid(pid_, &status, WNOHANG)) == 0 && now() < until) {
    if (tick) tick();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (ended == pid_) pid_ = -1;
  kill_and_wait();
  return ended <= 0 ? -1 : status;
}

std::string LineProcess::last_words() const {
  constexpr long kMost = 4096;
  std::fseek(errors_, 0, SEEK_END);
  const long size = std::ftell(errors_);
  std::fseek(errors_, std::max(0L, size - kMost), SEEK_SET);
  std::string text(static_cast<std::size_t>(std::clamp(size, 0L, kMost)), '\0');
  text.resize(std::fread(text.data(), 1, text.size(), errors_));
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::size_t begin = text.size();
  for (std::size_t lines = 0; lines < kLastLines && begin > 0 && begin != std::string::npos; ++lines)
    begin = text.rfind('\n', begin - 1);
  if (begin != std::string::npos && begin > 0) text.erase(0, begin + 1);
  return text.empty() ? ", with no message on standard error" : ":\n" + text;
}

}  // namespace fieldmark::bench
