#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/metrics.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace fieldmark {
namespace {

void check_pair(const char* op, const Tensor<float>& a, const Tensor<float>& b) {
  check_same(op, "a", a.shape, "b", b.shape);
  if (a.size() == 0)
    throw ShapeError("[" + std::string(op) + "] a must not be empty (a mean of nothing), got shape " +
                     a.shape.str());
}

double pairwise(std::span<const double> x) {
  if (x.size() == 1) return x[0];
  return pairwise(x.first(x.size() / 2)) + pairwise(x.subspan(x.size() / 2));
}

// Sums over [0, n), n >= 1, chunk by chunk and then pairwise over the chunks. The result does not depend on
// the thread count, and the error grows with the chunk instead of n.
template <class Chunk>
double chunked_sum(Index n, Index grain, Chunk chunk) {
  std::vector<double> sums(static_cast<std::size_t>((n + grain - 1) / grain));
  parallel_for(n, grain, [&](Index begin, Index end) {
    sums[static_cast<std::size_t>(begin / grain)] = chunk(begin, end);
  });
  return pairwise(sums);
}

double decibels(std::uint64_t squares, Index count) {
  if (count == 0) return std::numeric_limits<double>::quiet_NaN();
  if (squares == 0) return std::numeric_limits<double>::infinity();
  return 10 * std::log10(255.0 * 255.0 * static_cast<double>(count) / static_cast<double>(squares));
}

std::uint64_t square_of_difference(std::uint8_t a, std::uint8_t b) {
  const std::int64_t d = std::int64_t{a} - b;
  return static_cast<std::uint64_t>(d * d);
}

constexpr int kWindow = 11;
constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;

std::array<double, kWindow> gaussian() {
  std::array<double, kWindow> w{};
  constexpr int kMiddle = kWindow / 2;
  for (int k = 0; k < kWindow; ++k) {
    const double x = (k - kMiddle) / 1.5;
    w[static_cast<std::size_t>(k)] = std::exp(-0.5 * x * x);
  }
  const double sum = std::accumulate(w.begin(), w.end(), 0.0);
  for (double& v : w) v /= sum;
  return w;
}

using Moments = Eigen::Array<double, Eigen::Dynamic, 5>;  // a, b, a a, b b, a b

Moments moments_of(const Tensor<float>& a, const Tensor<float>& b, Index row) {
  const Index line = a.shape[1] * a.shape[2];
  const auto line_of = [&](const Tensor<float>& image) {
    return Eigen::Map<const Eigen::ArrayXf>(&image.data[static_cast<std::size_t>(row * line)], line);
  };
  Moments m(line, 5);
  m.col(0) = line_of(a).cast<double>();
  m.col(1) = line_of(b).cast<double>();
  m.col(2) = m.col(0) * m.col(0);
  m.col(3) = m.col(1) * m.col(1);
  m.col(4) = m.col(0) * m.col(1);
  return m;
}

// Returns the sum of w_k part(k) as one expression, which Eigen evaluates in one pass.
template <class Part, std::size_t... K>
auto filtered(const std::array<double, kWindow>& w, Part part, std::index_sequence<K...>) {
  return (... + (w[K] * part(static_cast<Index>(K))));
}

// Rows [begin, end) of window positions. The window is separable: for each row of positions, five moments are
// filtered down the columns over all channels at once, and then along the row.
double ssim_rows(const Tensor<float>& a, const Tensor<float>& b, Index begin, Index end) {
  static const std::array<double, kWindow> window = gaussian();
  constexpr std::make_index_sequence<kWindow> kTaps;
  const Index channels = a.shape[2], line = a.shape[1] * channels,
              positions = line - (kWindow - 1) * channels;
  std::vector<Moments> lines;
  for (Index row = begin; row < end + kWindow - 1; ++row) lines.push_back(moments_of(a, b, row));
  Moments column(line, 5), m(positions, 5);
  Eigen::ArrayXd likeness(positions);
  double sum = 0;
  for (Index row = 0; row < end - begin; ++row) {
    for (Index q = 0; q < m.cols(); ++q) {
      column.col(q) = filtered(
          window, [&](Index k) { return lines[static_cast<std::size_t>(row + k)].col(q); }, kTaps);
      m.col(q) = filtered(
          window, [&](Index k) { return column.col(q).segment(k * channels, positions); }, kTaps);
    }
    const auto ma = m.col(0), mb = m.col(1);
    const auto va = m.col(2) - ma * ma, vb = m.col(3) - mb * mb, cov = m.col(4) - ma * mb;
    likeness = (2 * ma * mb + kC1) * (2 * cov + kC2) / ((ma * ma + mb * mb + kC1) * (va + vb + kC2));
    sum += std::accumulate(likeness.begin(), likeness.end(), 0.0);
  }
  return sum;
}

}  // namespace

double mse(const Tensor<float>& a, const Tensor<float>& b) {
  check_pair("mse", a, b);
  const double sum = chunked_sum(a.size(), 1024, [&](Index begin, Index end) {
    double s = 0;
    for (Index i = begin; i < end; ++i) {
      const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
      s += d * d;
    }
    return s;
  });
  return sum / static_cast<double>(a.size());
}

double psnr(const Tensor<float>& a, const Tensor<float>& b) {
  check_pair("psnr", a, b);
  const auto x = bytes_of(a), y = bytes_of(b);
  std::uint64_t squares = 0;
  for (std::size_t i = 0; i < x.size(); ++i) squares += square_of_difference(x[i], y[i]);
  return decibels(squares, a.size());
}

double psnr_masked(const Tensor<float>& a, const Tensor<float>& b, const Tensor<float>& mask) {
  check_pair("psnr_masked", a, b);
  check_rank("psnr_masked", "a", a.shape, 3, "[height, width, channels]");
  check_rank("psnr_masked", "mask", mask.shape, 2, "[height, width]");
  check_extent("psnr_masked", "mask", mask.shape, 0, a.shape[0], "the image's height");
  check_extent("psnr_masked", "mask", mask.shape, 1, a.shape[1], "the image's width");
  const auto x = bytes_of(a), y = bytes_of(b);
  const std::size_t channels = static_cast<std::size_t>(a.shape[2]);
  std::uint64_t squares = 0;
  Index count = 0;
  for (std::size_t pixel = 0; pixel < mask.data.size(); ++pixel) {
    if (!(mask.data[pixel] > 0.5f)) continue;
    for (std::size_t i = pixel * channels; i < (pixel + 1) * channels; ++i)
      squares += square_of_difference(x[i], y[i]);
    count += a.shape[2];
  }
  return decibels(squares, count);
}

double ssim(const Tensor<float>& a, const Tensor<float>& b) {
  check_pair("ssim", a, b);
  check_rank("ssim", "a", a.shape, 3, "[height, width, channels]");
  const Index rows = a.shape[0] - kWindow + 1, columns = a.shape[1] - kWindow + 1;
  if (rows < 1 || columns < 1)
    throw ShapeError("[ssim] a: height and width must be at least 11 (the window's), got shape " +
                     a.shape.str());
  const double sum =
      chunked_sum(rows, 8, [&](Index begin, Index end) { return ssim_rows(a, b, begin, end); });
  return sum / static_cast<double>(rows * columns * a.shape[2]);
}

}  // namespace fieldmark
