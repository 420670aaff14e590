#pragma once
#include <fieldmark/tools/results/plan.h>

namespace fieldmark::results {

/// Version of the files of rows; a row of another version is stale.
constexpr int kSchema = 1;

/// Rows by their ids. A row is a JSON object {schema, id, kind, command, commit, date, cpu, isa, threads,
/// compiler, seed, budget, seconds, inputs {WORD: SHA-256}, output (SHA-256 or null), code (SHA-256),
/// result}. `inputs` is null in rows of version 0.1, which did not record them.
using Rows = std::map<std::string, Json>;

/// All rows of a folder; empty where there is no folder. @throws IoError if a file is no row, or another's
Rows load_rows(const std::filesystem::path& folder);
/// Writes FOLDER/ID.json when it is complete; folders are made. @throws IoError
void save_row(const std::filesystem::path& folder, const Json& row);

/// What a measurement adds to the provenance of this build and machine.
struct Measured {
  std::string id, kind, command;
  Json result{}, inputs = Json::object(), output = nullptr;
  std::string code;  ///< Plan::code()
  std::uint64_t seed = 1;
  double budget = 0;   ///< seconds that the command was given; 0: none
  double seconds = 0;  ///< that it took
};
Json make_row(const Measured& measured);

/// Where the files are that commands read and make.
struct Places {
  std::filesystem::path data;  ///< FIELDMARK_DATA; empty: not there
  std::filesystem::path work;  ///< of "@FILE"
};
/// The path that a word "scene:NAME" or "@FILE" stands for.
std::filesystem::path path_of(const Plan& plan, const std::string& word, const Places& places);
/// The inverse for every string in a result that is a path below one of the places: "@FILE" of the work
/// folder, "data/FILE" of the data sets. Results name files, not where they lay.
Json with_names(Json result, const Places& places);
/// SHA-256 of a file, or of the names and contents of a folder's files; null where there is nothing.
Json hash_of(const std::filesystem::path& path);

/// Why a row must be measured again; empty if it is fresh. Inputs that other rows make are compared with the
/// hashes in those rows, data sets with the files where they are there.
std::string stale_reason(const Plan& plan, const PlannedRow& row, const Rows& rows, const Places& places);

/// The SHA-256 of each of a row's inputs. A file that another row makes is that row's output.
Json input_hashes(const Plan& plan, const PlannedRow& row, const Rows& rows, const Places& places);

}  // namespace fieldmark::results
