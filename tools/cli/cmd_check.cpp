#include <fieldmark/watermark/evidence/evidence_folder.h>

#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/images.h"

namespace fieldmark::cli {
namespace {

struct CheckArguments {
  std::string folder, public_key;
  std::vector<std::string> images;
};

Json result(const watermark::EvidenceCheck& check, std::size_t given) {
  Json json{{"intact", check.faults.empty()},
            {"faults", check.faults},
            {"images", given},
            {"images_known", check.images}};
  if (const auto& s = check.summary) {
    json["public_key"] = to_hex(s->signer);
    json["commitment"] = s->commitment;
    json["owner_sha256"] = s->owner_sha256;
    json["message"] = to_hex(s->message);
    json["found"] = s->found;
    json["p_value"] = s->p_value;
  }
  return json;
}

int run_check(const CheckArguments& options, Context& context) {
  std::optional<watermark::PublicKey> signer;
  if (!options.public_key.empty())
    signer = read_option("--public-key", [&] { return watermark::public_key_from_hex(options.public_key); });
  const auto images = options.images.empty() ? std::vector<std::filesystem::path>{}
                                             : list_images(options.images, context, Videos::read);
  const auto check = watermark::check_evidence_folder(options.folder, images, signer);
  auto& out = context.text();
  for (const auto& fault : check.faults) out << fault << "\n";
  out << options.folder << (check.faults.empty() ? ": INTACT" : ": ALTERED") << "\n";
  if (const auto& s = check.summary; s && check.faults.empty()) {
    char p[40];
    std::snprintf(p, sizeof p, "%.2e", s->p_value);
    out << "verdict     " << (s->found ? "FOUND" : "NOT FOUND") << ", p " << p << ", message "
        << to_hex(s->message) << "\ncommitment  " << s->commitment << "\nsigned by   " << to_hex(s->signer)
        << (signer ? ", as expected" : ", not compared with a known key (see --public-key)")
        << "\nimages      " << check.images << " of those given belong to it\n";
  }
  context.result(result(check, images.size()));
  return check.faults.empty() ? kOk : kFailed;
}

}  // namespace

Command add_check(CommandLine& app) {
  auto o = std::make_shared<CheckArguments>();
  app.add_option("folder", o->folder, "Evidence folder from `fieldmark verify`")
      ->required()
      ->type_name("DIR");
  app.add_option("images", o->images,
                 "Images or videos, or folders of them, to compare by SHA-256 with those of the evidence")
      ->type_name("IMAGE|VIDEO|DIR")
      ->default_str("");
  app.add_option("--public-key", o->public_key,
                 "Public key of the signer, 64 digits, as `key`, `embed` and `bake` print it; default: any")
      ->type_name("HEX")
      ->default_str("");
  return [o](Context& context) { return run_check(*o, context); };
}

}  // namespace fieldmark::cli
