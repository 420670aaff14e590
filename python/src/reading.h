#pragma once
#include <fieldmark/watermark/mark/owner.h>

#include <string>

#include "arrays.h"

namespace fieldmark::python {

/// @{
/// Reads the message from images, or tests images for a message: the results of `fieldmark extract` and
/// `verify`, see docs/json.md, without what needs files.
/// @param images  a sequence of float32 arrays [H, W, 3] in [0, 1], or one such array
/// @param detection  auto, blind or informed   @param fpr  false-positive rate of `read` and `found`, in (0,
/// 1]
/// @throws TypeError, ShapeError, ValueError naming the argument, and the index of an image
py::dict extract(const watermark::Owner& owner, const py::object& images, const std::string& detection,
                 double fpr);
py::dict verify(const watermark::Owner& owner, const std::string& message, const py::object& images,
                const std::string& detection, double fpr);
/// @}

}  // namespace fieldmark::python
