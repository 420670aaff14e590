#include "camera_motion.h"

#include <Eigen/Geometry>

namespace fieldmark::watermark {
namespace {

using Matrix3 = Eigen::Matrix3d;
using Vector3 = Eigen::Vector3d;

Matrix3 rotation(const nerf::Camera& c) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(c.pose.data()).leftCols<3>();
}

Vector3 vector(const nerf::Vec3& v) { return {v[0], v[1], v[2]}; }

Vector3 in_axes(const nerf::Camera& c, const nerf::Vec3& p) {
  return rotation(c).transpose() * (vector(p) - vector(c.position()));
}

Matrix3 turned(const Vector3& turn) {
  const double angle = turn.norm();
  if (angle < 1e-12) return Matrix3::Identity();
  return Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
}

}  // namespace

Projection project(const nerf::Camera& camera, const nerf::Vec3& point) {
  const Vector3 q = in_axes(camera, point);
  return {camera.cx - camera.fx * q.x() / q.z(), camera.cy + camera.fy * q.y() / q.z(), -q.z()};
}

nerf::Camera moved(const nerf::Camera& camera, const nerf::Vec3& pivot, const CameraMotion& motion) {
  const Matrix3 r = rotation(camera);
  const Vector3 m = in_axes(camera, pivot);
  // q' = E q + b in the old camera's axes gives R' = R E^T and t' = t - R' b.
  const Matrix3 e = turned({motion[0], motion[1], motion[2]});
  const Vector3 b = m - e * m - m.z() * Vector3(motion[3], motion[4], motion[5]);
  const Matrix3 turned_r = r * e.transpose();
  const Vector3 position = vector(camera.position()) - turned_r * b;
  nerf::Camera out = camera;
  Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> pose(out.pose.data());
  pose.leftCols<3>() = turned_r;
  pose.col(3) = position;
  out.fx *= std::exp(motion[6] + motion[9]);
  out.fy *= std::exp(motion[6]);
  out.cx += motion[7] * static_cast<double>(camera.width);
  out.cy += motion[8] * static_cast<double>(camera.width);
  return out;
}

std::array<CameraMotion, 2> motion_gradient(const nerf::Camera& camera, const nerf::Vec3& pivot,
                                            const nerf::Vec3& point) {
  const Vector3 q = in_axes(camera, point), m = in_axes(camera, pivot), arm = q - m;
  const double u = -q.x() / q.z(), v = -q.y() / q.z();  // tangents; x = cx + fx u, y = cy - fy v
  // dq of each motion: e_k x arm for a turn, -m_z e_k for a shift; du = -(dq_x + u dq_z) / q_z, dv alike.
  std::array<CameraMotion, 2> gradient{};
  for (int k = 0; k < 6; ++k) {
    const Vector3 axis = Vector3::Unit(k % 3);
    const Vector3 dq = k < 3 ? Vector3(axis.cross(arm)) : Vector3(-m.z() * axis);
    gradient[0][static_cast<std::size_t>(k)] = -camera.fx * (dq.x() + u * dq.z()) / q.z();
    gradient[1][static_cast<std::size_t>(k)] = camera.fy * (dq.y() + v * dq.z()) / q.z();
  }
  gradient[0][6] = gradient[0][9] = camera.fx * u;
  gradient[1][6] = -camera.fy * v;
  gradient[0][7] = gradient[1][8] = static_cast<double>(camera.width);
  return gradient;
}

}  // namespace fieldmark::watermark
