// Feeds mutations of valid files to the readers of foreign formats: each must be read or refused with an
// Error.
//   fuzz_readers [INPUTS = 20000] [SEED = 1] [FIRST = 0] [FORMAT = all of them, by turns]
// Input i depends only on SEED, i and FORMAT, so `fuzz_readers 1 SEED i FORMAT` repeats one. The sanitizers
// (preset asan) detect crashes and leaks.
#include <fieldmark/core/error.h>
#include <sys/resource.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <iostream>
#include <limits>
#include <random>

#include "fuzz/formats.h"
#include "nerf/format_samples.h"

using namespace fieldmark;

namespace {
using Random = std::mt19937_64;
constexpr double kSecondsForOne = 2;
constexpr std::size_t kEnough = 200;         // inputs of a format, from which its counts are judged
constexpr rlim_t kMemory = rlim_t{2} << 30;  // a file of kilobytes must not need more

std::string number(Random& random) {
  static const std::string words[] = {
      "0",     "-1",    "1e308",      "-1e-308", "nan",  "inf", "18446744073709551616",
      "2.5e9", "1e999", "0x7fffffff", "65537",   "[",    "]",   "{",
      "}",     "\"",    ",",          ":",       "null", "\n",  "\\u0000"};
  static const std::string bytes[] = {packed(std::numeric_limits<std::uint64_t>::max()),
                                      packed(std::numeric_limits<std::int64_t>::min()),
                                      packed(std::numeric_limits<double>::quiet_NaN()),
                                      packed(std::numeric_limits<double>::infinity()),
                                      packed(std::numeric_limits<double>::denorm_min()),
                                      packed(1e300),
                                      packed(std::uint64_t{1} << 40),
                                      packed(std::uint64_t{0}),
                                      packed(std::uint32_t{0x80000000})};
  return random() % 2 ? words[random() % std::size(words)] : bytes[random() % std::size(bytes)];
}

void mutate(std::string& s, const std::string& other, Random& random) {
  if (s.empty()) {
    s = number(random);
    return;
  }
  const std::size_t at = random() % s.size(), length = 1 + random() % 40;
  switch (random() % 8) {
    case 0:
      s[at] = static_cast<char>(s[at] ^ (1 << random() % 8));
      break;
    case 1:
      s[at] = static_cast<char>(random());
      break;
    case 2:
      s.resize(at);
      break;
    case 3:
      s.erase(at, length);
      break;
    case 4:
      s.insert(at, number(random));
      break;
    case 5: {
      const std::string by = number(random);
      s.replace(at, by.size(), by);
      break;
    }
    case 6:
      s.insert(at, s.substr(random() % s.size(), length));
      break;
    default:
      s.replace(at, length, other.substr(random() % other.size(), 1 + random() % 40));
  }
}

// Mutates the header of a safetensors file and updates its length, so that the data still fits.
void mutate_header(std::string& s, const std::string& other, Random& random) {
  std::uint64_t length = 0;
  std::memcpy(&length, s.data(), sizeof length);
  std::string header = s.substr(sizeof length, length);
  mutate(header, other, random);
  s = packed(static_cast<std::uint64_t>(header.size())) + header + s.substr(sizeof length + length);
}

struct Outcome {
  std::size_t read = 0, refused = 0;
};

// Returns false if it threw something other than an Error, or took too long.
bool try_one(const Format& format, const std::string& input, Outcome& outcome) {
  const std::clock_t begin = std::clock();  // time of this process: others may use the CPU
  try {
    format.read(input);
    ++outcome.read;
  } catch (const Error&) {
    ++outcome.refused;
  } catch (const std::exception& e) {
    std::cerr << format.name << ": not an Error: " << e.what() << "\n";
    return false;
  } catch (...) {
    std::cerr << format.name << ": not an exception\n";
    return false;
  }
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  if (seconds > kSecondsForOne) std::cerr << format.name << ": took " << seconds << " s\n";
  return seconds <= kSecondsForOne;
}

// only: name of a format; empty: all of them, by turns
int run(std::size_t inputs, std::uint64_t seed, std::size_t first, const std::string& only) {
  std::vector<Format> all = formats();
  if (!only.empty()) std::erase_if(all, [&](const Format& f) { return f.name != only; });
  if (all.empty()) {
    std::cerr << only << ": no such format, or this build lacks its library\n";
    return 2;
  }
  std::vector<Outcome> outcomes(all.size());
  for (std::size_t k = 0; k < all.size(); ++k)
    for (const auto& sample : all[k].samples)
      all[k].read(sample);  // valid: an exception here ends the program
  std::size_t failures = 0;
  for (std::size_t i = first; i < first + inputs; ++i) {
    std::seed_seq words{seed, seed >> 32, std::uint64_t{i}, std::uint64_t{i} >> 32};
    Random random(words);
    const std::size_t k = i % all.size();
    const Format &format = all[k], &other = all[random() % all.size()];
    std::string input = format.samples[random() % format.samples.size()];
    const bool header = format.safetensors && random() % 8 != 0;
    for (auto edits = 1 + random() % 3; edits > 0; --edits)
      (header ? mutate_header : mutate)(input, other.samples[0], random);
    if (!try_one(format, input, outcomes[k])) {
      std::cerr << "  input " << i << ": repeat with fuzz_readers 1 " << seed << " " << i << " " << only
                << "\n";
      ++failures;
    }
  }
  for (std::size_t k = 0; k < all.size(); ++k) {
    std::cout << all[k].name << ": " << outcomes[k].read << " read, " << outcomes[k].refused << " refused\n";
    // A reader that refuses nothing, or everything, is not the one that was meant.
    const bool enough = outcomes[k].read + outcomes[k].refused >= kEnough;
    if (enough && (outcomes[k].read == 0 || (outcomes[k].refused == 0) == all[k].refuses)) {
      std::cerr << all[k].name << ": expected some inputs to be read"
                << (all[k].refuses ? " and some refused\n" : " and none refused\n");
      ++failures;
    }
  }
  std::cout << inputs << " inputs, " << failures << " failures\n";
  return failures == 0 ? 0 : 1;
}
}  // namespace

int main(int count, char** words) {
#ifndef __SANITIZE_ADDRESS__  // which maps terabytes; there ASAN_OPTIONS=max_allocation_size_mb bounds an
                              // allocation
  const rlimit memory{kMemory, kMemory};
  ::setrlimit(RLIMIT_AS, &memory);
#endif
  for (int i = 1; i < count && i < 4; ++i)
    if (std::string(words[i]).find_first_not_of("0123456789") != std::string::npos) {
      std::cerr << words[i] << ": expected a number; a format is the fourth argument\n";
      return 2;
    }
  const auto argument = [&](int i, unsigned long long otherwise) {
    return i < count ? std::strtoull(words[i], nullptr, 10) : otherwise;
  };
  return run(argument(1, 20000), argument(2, 1), argument(3, 0), count > 4 ? words[4] : "");
}
