#include <fieldmark/nerf/analytic_scene.h>

#include <filesystem>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"

namespace fieldmark::cli {
namespace {

struct SceneArguments {
  std::string out;
  std::string kind = "objects";
  Index size = 200;
  Index views = 100;
};

// The files have the names of every data set in the Blender layout.
void check_folder(const std::string& folder) {
  for (const char* split : {"train", "val", "test"}) {
    const std::string name = "transforms_" + std::string(split) + ".json";
    if (std::filesystem::exists(std::filesystem::path(folder) / name))
      throw IoError(folder + ": expected a folder without a data set, found " + name +
                    "; name another folder");
  }
}

int run_scene(const SceneArguments& options, Context& context) {
  check_folder(options.out);
  const nerf::SceneOptions scene{.kind = nerf::parse_scene_kind(options.kind),
                                 .size = options.size,
                                 .views = options.views,
                                 .seed = context.seed()};
  const InterruptGuard guard;
  Index images = 0;
  {
    Progress progress = context.progress("scene");
    nerf::write_scene(scene, options.out, [&](Index done, Index total) {
      progress.update(static_cast<double>(done) / static_cast<double>(total));
      images = total;
      if (guard.interrupted())
        throw Interrupted(options.out + " is incomplete; remove it and run the command again");
    });
  }
  context.text() << options.out << ": " << images << " views of " << options.size << "x" << options.size
                 << "\n";
  context.result({{"out", options.out},
                  {"kind", options.kind},
                  {"size", options.size},
                  {"views", options.views},
                  {"images", images}});
  return kOk;
}

}  // namespace

Command add_scene(CommandLine& app) {
  auto options = std::make_shared<SceneArguments>();
  app.add_option("--out", options->out, "Folder to write the data set to, in Blender layout")
      ->required()
      ->type_name("DIR");
  app.add_option(
         "--kind", options->kind,
         "Kind of scene. objects: textured solids on a slab; sphere: one shaded sphere;\nwires: a stand of "
         "thin rods, rings "
         "and cables; plain: large solids of one colour each;\nglossy: solids whose colours depend on the "
         "view")
      ->one_of({"objects", "sphere", "wires", "plain", "glossy"})
      ->type_name("KIND");
  app.add_option("--size", options->size, "Width and height of the images in pixels, 1 to 8192")
      ->range(1, 8192)
      ->type_name("N");
  app.add_option("--views", options->views,
                 "Training images, 1 to 100000; val gets a tenth of that, test a quarter")
      ->range(1, 100000)
      ->type_name("N");
  return [options](Context& context) { return run_scene(*options, context); };
}

}  // namespace fieldmark::cli
