#include "cli/fingerprints.h"

#include <fieldmark/core/files.h>
#include <fieldmark/watermark/tracing/copies.h>

#include <algorithm>
#include <cstddef>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "watermark/small_owner.h"
#include "watermark/test_key.h"

using namespace fieldmark;
using namespace fieldmark::watermark;
using cli::networks_sha256;
using cli::recipients_sha256;

TEST_CASE("fingerprints: the hash of the networks covers every tensor but the key, in any order") {
  const TemporaryFolder folder;
  Owner owner = small_owner();
  const auto saved = [&] {
    owner.save(folder / "a");
    return SafetensorsFile::read(folder / "a");
  };
  const SafetensorsFile file = saved();
  const std::string hash = networks_sha256(file);
  CHECK(hash.size() == 64);
  owner.set_code(test_key(9), 3);
  CHECK(networks_sha256(saved()) == hash);
  SafetensorsFile changed = file;
  std::ranges::reverse(changed.tensors);
  CHECK(networks_sha256(changed) == hash);
  for (std::size_t i = 0; i < file.tensors.size(); ++i) {
    changed = file;
    auto& tensor = changed.tensors[i];
    CAPTURE(tensor.name);
    if (tensor.data.empty()) continue;
    tensor.data.back() ^= std::byte{1};
    CHECK((networks_sha256(changed) == hash) == (tensor.name == "key"));
    changed = file;
    changed.tensors[i].name += "x";
    CHECK(networks_sha256(changed) != hash);
  }
}

TEST_CASE("fingerprints: the hash of a list is that of its sorted lines, as sort and sha256sum compute it") {
  const std::string want = "4d39f59b9f6c4a15d1e382318c02441902b6d81e968af91cfb235a5457440a78";
  CHECK(recipients_sha256({"Anna", "Bertil B.", "\xC3\x85sa"}) == want);
  CHECK(recipients_sha256({"\xC3\x85sa", "Bertil B.", "Anna"}) == want);
  CHECK(recipients_sha256({"Anna", "Bertil B.", "Asa"}) != want);
  CHECK(recipients_sha256({"Anna", "Bertil B."}) != want);
  const TemporaryFolder folder;
  const auto path = folder / "names.txt";
  write_file_atomically(path, "\xC3\x85sa\r\n\n  Anna\nBertil B.");
  CHECK(recipients_sha256(read_recipients(path)) == want);
}
