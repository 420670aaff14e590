#include "cli/evidence_page.h"

#include <fieldmark/imaging/image.h>

#include <cmath>
#include <set>

#include "imaging/media_samples.h"
#include "support/catch.h"
#include "support/random.h"
#include "watermark/small_evidence.h"

using namespace fieldmark;
using namespace fieldmark::cli;

namespace {
PageImages small_images() { return {{"data:a", "data:b"}, {"data:c", "data:d"}}; }

std::string small_page(const watermark::EvidenceRecord& record = small_evidence()) {
  return evidence_page(record, watermark::public_key(test_key(5)), small_images());
}

// Returns the tags that are opened but not closed, except those that need no end tag.
std::vector<std::string> open_tags(const std::string& html) {
  const std::set<std::string> empty{"meta", "img", "br", "rect", "line", "circle", "!doctype"};
  std::vector<std::string> open;
  for (std::size_t at = html.find('<'); at != std::string::npos; at = html.find('<', at + 1)) {
    const bool end = html[at + 1] == '/';
    const std::size_t from = at + 1 + end;
    const std::string name = html.substr(from, html.find_first_of(" >\n/", from) - from);
    if (end) {
      if (open.empty() || open.back() != name) return {"</" + name + "> at " + std::to_string(at)};
      open.pop_back();
    } else if (empty.count(name) == 0) {
      open.push_back(name);
    }
  }
  return open;
}
}  // namespace

TEST_CASE("evidence_page: verdict, limits, figures and images, in tags that close", "[evidence]") {
  const std::string page = small_page();
  CHECK(page == small_page());
  CHECK(open_tags(page).empty());
  for (const char* text :
       {"The mark was found", "What this does not prove", "time-stamped before the field", "view_0.png",
        "view_1.png", "Wrong keys", "class=\"mark\"", "fieldmark check", "lang=\"en\"", "scope=\"col\""}) {
    CHECK_THAT(page, Contains(text));
  }
  const std::string commitment(64, 'c');
  CHECK_THAT(page, Contains(commitment) && Contains(to_hex(watermark::public_key(test_key(5)))));
  for (const char* image : {"src=\"data:a\"", "src=\"data:b\"", "src=\"data:c\"", "src=\"data:d\""})
    CHECK_THAT(page, Contains(image));
  CHECK_THAT(page, !Contains("<script") && !Contains("https://"));
  CHECK_THAT(page, !Contains(to_hex(test_key(5))));
}

TEST_CASE("evidence_page: what the verdict does not cover is said beside it", "[evidence]") {
  CHECK_THAT(small_page(), !Contains("not proven") && !Contains("contradict") && !Contains("one recipient"));
  watermark::EvidenceRecord record = small_evidence();
  record.key_free = false;
  record.copy = "Anna & Sons";
  record.together.reading.logit[0] = 9;
  record.message.bits[0] ^= 1;
  const std::string page = small_page(record);
  CHECK(open_tags(page).empty());
  CHECK_THAT(page, Contains("The bound is not proven") && Contains("Bits that contradict the message: 1.") &&
                       Contains("the copy of one recipient, Anna &amp; Sons"));
}

TEST_CASE("evidence_page: no image is without words for who cannot see it", "[evidence]") {
  const std::string page = small_page();
  for (std::size_t at = page.find("<img"); at != std::string::npos; at = page.find("<img", at + 1))
    CHECK_THAT(page.substr(at, page.find('>', at) - at), Contains(" alt=\"") && !Contains("alt=\"\""));
  for (std::size_t at = page.find("<figure"); at != std::string::npos; at = page.find("<figure", at + 1))
    CHECK_THAT(page.substr(at, page.find('>', at) - at), Contains("aria-label=\""));
}

TEST_CASE("evidence_page: names of files cannot break out", "[evidence]") {
  auto record = small_evidence();
  record.images[0].name = "\"><script>alert('1')</script>&.png";
  record.controls[1].name = "<b onclick='x'>";
  const std::string page = small_page(record);
  CHECK(open_tags(page).empty());
  CHECK_THAT(page, !Contains("<script") && !Contains("<b "));
  CHECK_THAT(page, Contains("&quot;&gt;&lt;script&gt;alert(&#39;1&#39;)&lt;/script&gt;&amp;.png"));
}

TEST_CASE("evidence_page: no mark, and a control that responds, are said in words", "[evidence]") {
  auto record = small_evidence();
  record.fpr = 1e-9;
  CHECK_THAT(small_page(record), Contains("The mark was not found") && !Contains("The mark was found"));
  record.fpr = 1;
  CHECK_THAT(small_page(record), Contains("The test also responded to controls: blank, clean"));
  record.controls.clear();
  record.wrong_keys.reset();
  const std::string page = evidence_page(record, {}, {{"data:a", "data:b"}, {}});
  CHECK_THAT(page, Contains("No controls were tested") && !Contains("Wrong keys"));
  CHECK(open_tags(page).empty());
}

TEST_CASE("evidence_page: a small probability is told as one in so many", "[evidence]") {
  auto record = small_evidence();
  const auto told = [&](double fpr, const char* text) {
    record.fpr = fpr;
    CHECK_THAT(small_page(record), Contains(text));
  };
  told(1, "required: 100%)");
  told(0.5, "required: 50%)");
  told(1e-6, "at most 1 in 1&nbsp;000&nbsp;000 was required.");
  told(2e-5, "at most 1 in 50&nbsp;000 was required.");  // a requirement is not rounded
  told(2.3e-5, "at most 2.3e-05 was required.");
  told(1e-12, "at most 1 in 10<sup>12</sup> was required.");
}

TEST_CASE("evidence_page: a wrong bit is underlined, an undecided one a dash", "[evidence]") {
  auto record = small_evidence();
  auto& reading = record.images[0].score.reading;
  reading.message = {{1, 1, 0, 1}};
  reading.decided = {1, 1, 0, 1};
  CHECK_THAT(small_page(record), Contains("<code>1<u>1</u><u>-</u>1</code>"));
}

TEST_CASE("evidence_page: a small copy keeps the image's shape and is a JPEG", "[evidence]") {
  const auto decoded = [](const Tensor<float>& image) {
    const std::string address = thumbnail(image), head = "data:image/jpeg;base64,";
    REQUIRE(address.starts_with(head));
    return decode_image(from_base64(std::string_view(address).substr(head.size())), "thumbnail");
  };
  CHECK(decoded(uniform<float>({400, 200, 3}, 0, 1, 1)).shape == Shape{160, 80, 3});
  CHECK(decoded(uniform<float>({1, 3000, 3}, 0, 1, 1)).shape == Shape{1, 160, 3});
  const Tensor<float> grey({30, 50, 3}, 0.5f);
  const auto same = decoded(grey);
  REQUIRE(same.shape == grey.shape);
  for (float v : same.data) CHECK(std::abs(v - 0.5f) < 0.01f);
}
