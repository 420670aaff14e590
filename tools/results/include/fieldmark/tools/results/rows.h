#pragma once
#include <fieldmark/tools/results/plan.h>

namespace fieldmark::results {

/// Version of the row files; a row of another version is stale.
constexpr int kSchema = 1;

/// Rows by their ids. A row is a JSON object {schema, id, kind, command, commit, date, cpu, isa, threads,
/// compiler, seed, budget, seconds, inputs {WORD: SHA-256}, output (SHA-256 or null), code (SHA-256),
/// result}. `inputs` is null in rows of version 0.1, which did not record them.
using Rows = std::map<std::string, Json>;

/// Loads all rows of a folder; empty if the folder does not exist. @throws IoError if a file is not a row, or
/// holds another file's
Rows load_rows(const std::filesystem::path& folder);
/// Writes FOLDER/ID.json atomically; creates folders. @throws IoError
void save_row(const std::filesystem::path& folder, const Json& row);

/// The part of a row that the measurement supplies; the provenance of build and machine is added.
struct Measured {
  std::string id, kind, command;
  Json result{}, inputs = Json::object(), output = nullptr;
  std::string code;  ///< Plan::code()
  std::uint64_t seed = 1;
  double budget = 0;   ///< budget of the command in seconds; 0: none
  double seconds = 0;  ///< its duration
};
Json make_row(const Measured& measured);

/// Locations of the files that commands read and create.
struct Places {
  std::filesystem::path data;  ///< FIELDMARK_DATA; empty: not available
  std::filesystem::path work;  ///< folder of "@FILE"
};
/// Returns the path that a word "scene:NAME" or "@FILE" stands for.
std::filesystem::path path_of(const Plan& plan, const std::string& word, const Places& places);
/// Replaces every path below one of the places in a result by its name: "@FILE" for the work folder,
/// "data/FILE" for the data sets. Results thus name files independently of their location.
Json with_names(Json result, const Places& places);
/// Returns the SHA-256 of a file, or of the names and contents of a folder's files; null if there is none.
Json hash_of(const std::filesystem::path& path);

/// Returns why a row must be measured again; empty if it is fresh. Compares inputs that other rows create
/// with the hashes in those rows, and data sets with the files if they are available.
std::string stale_reason(const Plan& plan, const PlannedRow& row, const Rows& rows, const Places& places);

/// Returns the SHA-256 of each input of a row. For a file that another row creates, it is that row's
/// `output`.
Json input_hashes(const Plan& plan, const PlannedRow& row, const Rows& rows, const Places& places);

}  // namespace fieldmark::results
