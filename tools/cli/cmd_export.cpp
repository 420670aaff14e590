#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/tools/results/report.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <ostream>

#include "cli/camera_path.h"
#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/counted.h"
#include "cli/images.h"
#include "cli/mesh_files.h"
#include "cli/outputs.h"
#include "cli/surface.h"
#include "cli/turntable.h"

namespace fieldmark::cli {
namespace {

struct ExportArguments {
  std::string field, out;
  Index resolution = 256, size = 400, rows = 5, columns = 36;
  double density = 70;
  int quality = 85;
  bool of_surface = false, of_page = false;  // options for one kind of file were given
};

constexpr std::size_t kLargestPage = 300'000'000;  // bytes of images; browsers refuse scripts of some 500 MB

void check_options(const ExportArguments& options) {
  const std::string end = extension_of(options.out);
  if (end != ".html" && end != ".ply" && end != ".glb")
    throw UsageError("--out: expected a file that ends in .html, .ply or .glb, got '" + options.out + "'");
  if (options.of_surface && end == ".html")
    throw UsageError("--resolution, --density: only for .ply and .glb files; a page has images");
  if (options.of_page && end != ".html")
    throw UsageError("--size, --rows, --columns, --quality: only for .html files; a " + end +
                     " has no images");
}

void export_page(const ExportArguments& options, const nerf::RadianceField& field, Context& context,
                 Json& result) {
  const CameraGrid grid = camera_grid(field.cameras, options.rows, options.columns, options.size);
  nerf::Renderer renderer(field);
  std::vector<std::vector<std::byte>> jpegs;
  std::size_t bytes = 0;
  const InterruptGuard guard;
  Progress progress = context.progress("export");
  for (const nerf::Camera& camera : grid.cameras) {
    if (guard.interrupted()) throw Interrupted("nothing was written");
    jpegs.push_back(encode_jpeg(renderer.render(camera).rgb, options.quality));
    bytes += jpegs.back().size();
    if (bytes > kLargestPage)
      throw ValueError(options.out + ": a page holds at most 300 MB of images, which " +
                       std::to_string(jpegs.size()) + " of " + std::to_string(grid.cameras.size()) +
                       " views exceed; choose fewer, smaller or lower-quality ones");
    progress.update(static_cast<double>(jpegs.size()) / static_cast<double>(grid.cameras.size()));
  }
  write_file_atomically(options.out,
                        turntable_page(grid, jpegs, std::filesystem::path(options.field).filename().string(),
                                       field.background == nerf::Background::black));
  result["views"] = jpegs.size();
}

void export_surface(const ExportArguments& options, const nerf::RadianceField& field, Context& context,
                    Json& result) {
  const InterruptGuard guard;
  Mesh mesh;
  {
    Progress progress = context.progress("export");
    mesh =
        surface_of(field, {.resolution = options.resolution, .density = options.density}, [&](double part) {
          progress.update(part);
          return !guard.interrupted();
        });
  }
  if (guard.interrupted()) throw Interrupted("nothing was written");
  if (mesh.triangles.empty())
    throw ValueError(options.field + ": no surface has a density of " + results::shown(options.density) +
                     "; choose another --density");
  if (extension_of(options.out) == ".ply")
    write_ply(options.out, mesh);
  else
    write_glb(options.out, mesh, field.cameras.up);
  result["vertices"] = mesh.positions.size();
  result["triangles"] = mesh.triangles.size();
}

int run_export(const ExportArguments& options, Context& context) {
  check_options(options);
  check_writable_page(options.out);
  const auto field = nerf::RadianceField::load(options.field);
  Json result = {{"out", options.out}};
  if (extension_of(options.out) == ".html")
    export_page(options, field, context, result);
  else
    export_surface(options, field, context, result);
  result["file_bytes"] = std::filesystem::file_size(options.out);
  context.text() << options.out << ": "
                 << (result.contains("views") ? counted(result["views"], "view")
                                              : counted(result["vertices"], "point"))
                 << ", " << result["file_bytes"].dump() << " bytes\n";
  context.result(result);
  return kOk;
}

}  // namespace

Command add_export(CommandLine& app) {
  auto o = std::make_shared<ExportArguments>();
  app.add_option("--field", o->field, "Field to export")->required()->type_name("FIELD");
  app.add_option("--out", o->out,
                 "File to write: .html, a page that shows the scene from all sides; .ply, the points of its "
                 "surface; .glb, a mesh")
      ->required()
      ->type_name("FILE");
  const Option surface[] = {
      app.add_option("--resolution", o->resolution, "Cells per axis to search for the surface, 8 to 512")
          ->range(8, 512)
          ->type_name("N"),
      app.add_option("--density", o->density,
                     "Density of the surface in units of 1 / side of the scene's cube, 3 to 100000")
          ->range(3.0, 1e5)
          ->type_name("D")};
  const Option page[] = {
      app.add_option("--size", o->size, "Longer side of the page's images in pixels, 16 to 4096")
          ->range(16, 4096)
          ->type_name("N"),
      app.add_option("--rows", o->rows, "Rows of views of the page, from below to above, 1 to 100")
          ->range(1, 100)
          ->type_name("N"),
      app.add_option("--columns", o->columns, "Views per row, around the scene, 1 to 720")
          ->range(1, 720)
          ->type_name("N"),
      app.add_option("--quality", o->quality, "JPEG quality of the page's images, 1 to 100")
          ->range(1, 100)
          ->type_name("N")};
  const auto given = [](const auto& options) {
    return std::ranges::any_of(options, [](const Option& option) { return option.count() > 0; });
  };
  return [=](Context& context) {
    o->of_surface = given(surface);
    o->of_page = given(page);
    return run_export(*o, context);
  };
}

}  // namespace fieldmark::cli
