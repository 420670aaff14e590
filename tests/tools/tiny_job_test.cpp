#include "tools/tiny_job.h"

#include <fieldmark/nerf/radiance_field.h>
#include <fieldmark/watermark/mark/owner.h>

#include "support/catch.h"

// The scripts of this folder use this field.
TEST_CASE("tiny_job: a field and an owner of it that the commands read") {
  const TinyJob& job = TinyJob::get();
  CHECK(fieldmark::nerf::RadianceField::load(job.field).cameras.directions.size() == 16);
  CHECK(fieldmark::watermark::Owner::load(job.owner).options().bits == 4);
}
