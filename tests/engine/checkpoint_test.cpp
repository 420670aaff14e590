#include <fieldmark/core/error.h>
#include <fieldmark/engine/checkpoint.h>

#include <array>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;

TEST_CASE("checkpoint: numbers come back to where they were, in the run that they are of") {
  const TemporaryFolder folder;
  const std::string path = folder / "run.checkpoint";
  const std::array<float, 3> before{1, -2.5f, 3e-9f};
  SafetensorsFile file = new_checkpoint("ten steps");
  file.add("values", {3}, before);
  file.write(path);
  std::array<float, 3> after{};
  restore_numbers(read_checkpoint(path, "ten steps"), "values", after);
  CHECK(after == before);
}

TEST_CASE("checkpoint: another run, another kind of file and other sizes are named") {
  const TemporaryFolder folder;
  const std::string path = folder / "run.checkpoint", plain = folder / "plain";
  SafetensorsFile file = new_checkpoint("ten steps");
  file.add("values", {3}, std::array<float, 3>{});
  file.write(path);
  SafetensorsFile{}.write(plain);
  CHECK_THROWS_WITH(read_checkpoint(path, "nine steps"),
                    path + ": expected a checkpoint of this run (nine steps), found ten steps");
  CHECK_THROWS_WITH(read_checkpoint(plain, "nine steps"),
                    plain + ": expected a checkpoint of this run (nine steps), found another kind of file");
  CHECK_THROWS_AS(read_checkpoint(folder / "none", ""), IoError);
  std::array<float, 4> more{};
  CHECK_THROWS_WITH(restore_numbers(read_checkpoint(path, "ten steps"), "values", more),
                    path + ": tensor 'values': expected 4 numbers, found 3");
  CHECK_THROWS_AS(restore_numbers(read_checkpoint(path, "ten steps"), "means", more), IoError);
}
