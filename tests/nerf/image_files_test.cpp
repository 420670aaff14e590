#include "image_files.h"

#include "nerf/training_images.h"

using namespace fieldmark;
using namespace fieldmark::nerf;
namespace fs = std::filesystem;

namespace {
struct Files : TemporaryFolder {
  explicit Files(const std::vector<std::string>& names) {
    for (const auto& name : names) {
      fs::create_directories((path / name).parent_path());
      write_file_atomically(path / name, "");
    }
  }
  // Returns the file found for a name, relative to the folder.
  std::string found(const std::string& named) const {
    const fs::path file = ImageFinder().find(path / named);
    return file.empty() ? "" : file.lexically_relative(path).string();
  }
};
}  // namespace

TEST_CASE("image files: found by name, by extension, in another case and through backslashes") {
  const Files files({"images/0001.JPG", "images/0002.png", "images/b.PNG", "images/frame.0003.jpeg",
                     "images/R_1.png", "images/a\\c.png"});
  CHECK(files.found("images/0001.JPG") == "images/0001.JPG");
  CHECK(files.found("images/0001") == "images/0001.JPG");
  CHECK(files.found("images/0001.jpg") == "images/0001.JPG");
  CHECK(files.found("images/0002.jpg") == "images/0002.png");
  CHECK(files.found("images\\0002.png") == "images/0002.png");
  CHECK(files.found(".\\other\\..\\images\\0002.png") == "images/0002.png");
  CHECK(files.found("IMAGES/r_1") == "images/R_1.png");
  CHECK(files.found("images/frame.0003") == "images/frame.0003.jpeg");
  CHECK(files.found("images/B.jpg") == "images/b.PNG");
  CHECK(files.found("images/a\\c.png") == "images/a\\c.png");  // a name with a backslash
}

TEST_CASE("image files: another name is not taken, and of several alike the nearest name is") {
  const Files files({"images/frame.0003.jpeg", "images/r_1_depth.png", "images/x.png", "images/X.jpg",
                     "images/x.txt", "images/y.JPG", "images/Y.png"});
  CHECK(files.found("images/frame.0004") == "");
  CHECK(files.found("images/frame") == "");
  CHECK(files.found("images/r_1") == "");
  CHECK(files.found("images/x.txt2") == "");
  CHECK(files.found("nowhere/x.png") == "");
  CHECK(files.found("images/X.JPG") == "images/X.jpg");
  CHECK(files.found("images/x.jpeg") == "images/x.png");
  CHECK(files.found("images/Y.jpg") == "images/y.JPG");
  fs::create_directory(files / "images/z.png");
  CHECK(files.found("images/z.png") == "");
}

TEST_CASE("image files: PNG and JPEG files stand in for those of other formats, not for any extension") {
  const Files files({"images/0001.jpg", "images/r_0.png"});
  CHECK(files.found("images/0001.webp") == "images/0001.jpg");
  CHECK(files.found("images/0001.TIFF") == "images/0001.jpg");
  CHECK(files.found("images/0002.webp") == "");
  CHECK(files.found("images/r_0.5") == "");
}

TEST_CASE("image files: an absolute path of another computer is found by its longest end") {
  const Files files({"images/1.png", "scene/images/1.png", "1.png"});
  const auto found = [&](const std::string& named) {
    const fs::path file = ImageFinder().find_below(files.path, named);
    return file.empty() ? "" : file.lexically_relative(files.path).string();
  };
  CHECK(found("/home/me/scene/images/1.png") == "scene/images/1.png");
  CHECK(found("/data/images/1.png") == "images/1.png");
  CHECK(found("C:\\Users\\me\\images\\1.PNG") == "images/1.PNG");
  CHECK(found("D:/1.png") == "1.png");
  CHECK(found("/home/me/2.png") == "");
  CHECK(found("images/1.png") == "");
  CHECK(found("/") == "");
  CHECK(found("") == "");
}

TEST_CASE("image files: a folder's images are without hidden files and masks") {
  const Files files({"b.png", "a.JPEG", "._a.JPEG", "dynamic_mask_a.png", "notes.txt"});
  std::vector<fs::path> found;
  for (const auto& f : images_in(files.path)) found.push_back(f.filename());
  CHECK(found == std::vector<fs::path>{"a.JPEG", "b.png"});
  CHECK(images_in(files / "none").empty());
}

TEST_CASE("image files: the folder input stands in for images") {
  const TemporaryFolder folder;
  CHECK(image_folder(folder.path, 0).empty());
  CHECK(image_folder(folder / "none", 0).empty());
  write_image(folder / "input/a.jpg", 8, 6);
  CHECK(image_folder(folder.path, 0) == folder / "input");
  write_image(folder / "images_2/a.jpg", 4, 3);
  CHECK(image_folder(folder.path, 0) == folder / "images_2");
}
