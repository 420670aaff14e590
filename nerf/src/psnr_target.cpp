#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/nerf/psnr_target.h>

namespace fieldmark::nerf {

PsnrTarget::PsnrTarget(const RadianceField& field, double psnr, std::optional<Dataset> held_out)
    : psnr_(psnr), held_out_(std::move(held_out)), renderer_(field) {
  if (held_out_ && std::ssize(held_out_->views) > kViews) held_out_->views.resize(kViews);
}

bool PsnrTarget::reached(Index steps, double train_psnr) {
  if (psnr_ <= 0) return false;
  if (!held_out_) return train_psnr >= psnr_;
  if (steps == 0 || steps % kEvery != 0 || steps == evaluated_) return false;
  evaluated_ = steps;
  return evaluate(renderer_, *held_out_).psnr >= psnr_;
}

}  // namespace fieldmark::nerf
