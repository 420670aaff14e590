#include <fieldmark/watermark/mark/cell_mark.h>
#include <fieldmark/watermark/mark/fusion_mark.h>

#include <nlohmann/json.hpp>

namespace fieldmark::watermark {

Var<float> MarkTraining::reading_loss(const Params<float>&, Var<float>, const TrainingImage&,
                                      TrainingFigures&) const {
  throw ValueError("[reading_loss] owner must have cells in space, got one without");
}

CellCode Mark::code(const CellGrid& cells, const Key& key, Index bits) const {
  return deal_cells(key, cells.weights(), bits);
}

Var<float> Mark::carrier(const Params<float>&, Var<float>, Var<float>) const {
  throw ValueError("[carriers] owner must have cells in space, got one of preset " + preset());
}

MarkMaker stored_mark(const std::string& configuration) {
  const auto j = nlohmann::json::parse(configuration);
  // Version 0.1 could store ablations, which this program cannot make.
  for (const auto& [name, usual] : {std::pair{"colours", true}, {"budget", false}, {"keyed_signs", true}})
    if (j.value(name, usual) != usual)
      throw ValueError(std::string("[owner] ") + name + " must be " + (usual ? "true" : "false") +
                       ", got an ablation of version 0.1");
  const std::string preset = j.value("preset", "fast");
  if (preset == "fast") return cell_mark(stored_cell_mark(configuration));
  if (preset == "paper" || preset == "code") return fusion_mark(stored_fusion_mark(configuration));
  throw ValueError("[owner] preset must be fast, paper or code, got " + preset);
}

}  // namespace fieldmark::watermark
