#include <fieldmark/baselines/timed_run.h>
#include <fieldmark/core/files.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace fieldmark::baselines {
namespace {

constexpr double kCurvePoints = 200;
constexpr std::string_view kCurveHeader = "seconds,steps,figure\n";

std::filesystem::path beside(const std::filesystem::path& checkpoint, const char* ending) {
  return checkpoint.string() + ending;
}

class Course {
 public:
  explicit Course(const TimedRun& run) : run_(run), text_(kCurveHeader) {
    if (!std::filesystem::exists(run.checkpoint)) return;
    run.restore(run.checkpoint);
    before_ = std::strtod(read_text(beside(run.checkpoint, ".seconds")).c_str(), nullptr);
    text_ = read_text(beside(run.checkpoint, ".curve"));
    drawn_ = saved_ = before_;
  }
  double seconds() const {
    return before_ + std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }
  void draw(double now, bool last) {
    if (!last && now - drawn_ < run_.seconds / kCurvePoints) return;
    char line[80];
    std::snprintf(line, sizeof line, "%.1f,%lld,%.4f\n", now, static_cast<long long>(run_.steps()),
                  run_.figure());
    text_ += line;
    drawn_ = now;
  }
  void save(double now) {
    write_file_atomically(beside(run_.checkpoint, ".curve"), text_);
    write_file_atomically(beside(run_.checkpoint, ".seconds"), std::to_string(now) + "\n");
    run_.save(run_.checkpoint);  // last: a checkpoint without the other two would be of no use
    saved_ = now;
  }
  bool due(double now) const { return now - saved_ > run_.save_every; }

 private:
  const TimedRun& run_;
  std::string text_;
  double before_ = 0, drawn_ = 0, saved_ = 0;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace

double timed_run(const TimedRun& run, const RunProgress& progress) {
  Course course(run);
  while (!run.done()) {
    const double now = course.seconds();
    if (course.due(now)) course.save(now);
    run.step(now);
    course.draw(now, false);
    char note[48];
    std::snprintf(note, sizeof note, "step %lld, %.3f", static_cast<long long>(run.steps()), run.figure());
    if (progress && !progress(run.what, std::min(now / run.seconds, 1.0), note)) {
      course.save(course.seconds());
      throw Stopped(run.what + ": stopped after " + std::to_string(run.steps()) + " steps, saved");
    }
  }
  const double seconds = course.seconds();
  course.draw(seconds, true);
  course.save(seconds);
  return seconds;
}

std::string run_curve(const std::filesystem::path& checkpoint) {
  return read_text(beside(checkpoint, ".curve"));
}

void remove_run_files(const std::filesystem::path& checkpoint) {
  for (const char* ending : {"", ".seconds", ".curve"}) std::filesystem::remove(beside(checkpoint, ending));
}

}  // namespace fieldmark::baselines
