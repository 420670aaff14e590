#pragma once
#include <fieldmark/watermark/evidence/evidence_record.h>

#include "watermark/test_key.h"

/// Returns evidence of two images for a message of four bits on twelve cells, with a control and counted
/// keys.
inline fieldmark::watermark::EvidenceRecord small_evidence() {
  using namespace fieldmark::watermark;
  const std::vector<double> area(12, 1.0);
  const Message message{{1, 0, 1, 1}};
  const CellCode code = deal_cells(test_key(5), area, 4);
  const auto signs = cell_signs(code, message);
  std::vector<double> marked(signs.begin(), signs.end()), other(12);
  for (std::size_t c = 0; c < other.size(); ++c) other[c] = c % 3 == 0 ? 1 : -0.5;
  marked[2] *= -0.5;  // one cell reads wrong
  EvidenceRecord record;
  record.owner_sha256 = std::string(64, 'a');
  record.commitment = std::string(64, 'c');
  record.message = message;
  record.fpr = 0.02;
  record.cells = 12;
  record.together = score_evidence(marked, code, message);
  record.images = {{"view_0.png", std::string(64, '0'), 40, 30, score_evidence(marked, code, message)},
                   {"view_1.png", std::string(64, '1'), 40, 30, score_evidence(marked, code, message)}};
  const auto quiet = score_evidence(other, code, message);
  record.controls = {{"blank", "Nothing.", {{"blank 1", "", 40, 30, quiet}}, quiet},
                     {"clean", "Given.", {{"cat.jpg", std::string(64, '2'), 9, 8, quiet}}, quiet}};
  record.wrong_keys = count_wrong_keys(marked, area, message, 200, 1);
  record.seed = 1;
  record.commit = "0123456789ab";
  record.isa = "v3";
  return record;
}
