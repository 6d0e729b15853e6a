// SPDX-License-Identifier: BSD-3-Clause
// Every tool of the page, as a hand uses it: what is measured, shown and taken away.
#include "tests/app/view/view_browser_fixture.hpp"

namespace orbitfuse::view {
namespace {

using nlohmann::json;
using orbitfuse::test::Browser;
using Places = std::vector<std::pair<int, int>>;

/// Rendered, and without frusta in the way of what is touched.
void open(Browser& page, const std::string& url) {
  page.open(url);
  ASSERT_TRUE(page.becomes("viewer.surface.points"));
  ASSERT_TRUE(page.becomes("viewer.rest.finished && viewer.rest.level >= 2"));
  page.evaluate("$('show-visible').click(); $('show-thermal').click()");
}

/// What a tool measures at the places that are touched; null where it said why not.
json measured(Browser& page, const std::string& tool, const Places& places) {
  const int before = page.evaluate("viewer.measuring.list.length").get<int>();
  page.evaluate("document.querySelector('[data-value=" + tool + "]').click()");
  for (std::size_t i = 0; i < places.size(); ++i) {
    page.press(places[i].first, places[i].second);
    if (i + 1 < places.size() &&
        !page.becomes("viewer.measuring.places.length === " + std::to_string(i + 1)))
      return {};
  }
  if (!page.becomes("viewer.measuring.list.length === " + std::to_string(before + 1) +
                    " || $('measure-words').className === 'warning'"))
    return {};
  const json list = page.evaluate("viewer.measuring.list");
  return list.size() == static_cast<std::size_t>(before) + 1 ? list.back().at("answer") : json();
}

std::string words(Browser& page) { return page.evaluate("$('measure-words').textContent"); }

TEST_F(ViewBrowserTest, EveryToolMeasures) {
  Browser page(folder.path() / "profile", 1280, 800, false);
  open(page, url);
  const Places two{{600, 380}, {680, 430}};
  const json line = measured(page, "line", two);
  ASSERT_TRUE(line.is_object()) << words(page);
  EXPECT_GT(line.at("profile").size(), 10u);
  EXPECT_EQ(page.evaluate("document.querySelectorAll('.measurement canvas').length"), 1);
  const json box = measured(page, "box", two);
  ASSERT_TRUE(box.is_object()) << words(page);
  EXPECT_GT(box.at("reading").at("points").get<int>(), 10);
  EXPECT_LT(box.at("reading").at("min_k").get<double>(),
            box.at("reading").at("max_k").get<double>());
  const json difference = measured(page, "difference", two);
  ASSERT_TRUE(difference.is_object()) << words(page);
  EXPECT_NEAR(difference.at("difference_k").get<double>(),
              difference.at("of")[0].at("reading").at("temperature_k").get<double>() -
                  difference.at("of")[1].at("reading").at("temperature_k").get<double>(),
              1e-6);
  const json distance = measured(page, "distance", two);
  ASSERT_TRUE(distance.is_object()) << words(page);
  EXPECT_GT(distance.at("distance").get<double>(), 0);
  for (const char* count : {"4", "2"}) {
    page.evaluate(std::string("$('spot-count').value = '") + count + "'");
    const json hottest = measured(page, "hottest", {}), coldest = measured(page, "coldest", {});
    ASSERT_TRUE(hottest.is_object() && coldest.is_object()) << words(page);
    EXPECT_LE(hottest.at("spots").size(), std::stoul(count));
    EXPECT_GE(hottest.at("spots").size(), 1u);
    EXPECT_GT(hottest.at("spots")[0].at("temperature_k").get<double>(),
              coldest.at("spots")[0].at("temperature_k").get<double>());
  }
  page.evaluate("$('spot-count').value = '0'");
  EXPECT_TRUE(measured(page, "hottest", {}).is_null());
  EXPECT_NE(words(page).find("'0' is no number of places"), std::string::npos);

  // The frames behind the first measurement, each with its photo.
  page.evaluate(
      "$('menu').click(); (d => { d.open = true; d.scrollIntoView(); })"
      "(document.querySelector('.measurement details'))");
  const auto frames = line.at("reading").at("frames");
  ASSERT_GT(frames.size(), 0u);
  ASSERT_TRUE(
      page.becomes("document.querySelectorAll('.measurement details[open] button').length "
                   "=== " +
                   std::to_string(frames.size())));
  kept("tools", page.screenshot());
  page.evaluate("document.querySelector('.measurement details[open] button').click()");
  ASSERT_TRUE(page.becomes("$('photo').open && viewer.photo.shown.recorded"));
  EXPECT_EQ(page.evaluate("$('photo-name').textContent"), frames[0].at("frame"));
  EXPECT_TRUE(page.errors().empty()) << page.errors().front();
}

/// Pixels of the picture that follow the isotherm, the opacity and the line of the swipe.
TEST_F(ViewBrowserTest, IsothermOpacityAndSwipeChangeThePicture) {
  Browser page(folder.path() / "profile", 1280, 800, false);
  open(page, url);
  choose(page, "thermal");
  // As many pixels in its colour as have such a temperature; and none without.
  const std::string marked = R"((() => {
    const c = $('rest'), data = c.getContext('2d').getImageData(0, 0, c.width, c.height).data, part = viewer.rest.pictures.thermal;
    let marked = 0, meant = 0;
    for (let i = 0; i < part.counts.length; ++i) {
      marked += isothermColour.every((v, k) => Math.abs(data[4 * i + k] - v) < 2);
      meant += Number.isFinite(levelOf(part, part.counts[i])) && meetsIsotherm(levelOf(part, part.counts[i]));
    }
    return [marked, meant, c.width * c.height === part.counts.length];
  })())";
  EXPECT_EQ(page.evaluate(marked)[0], 0);
  page.evaluate(R"((() => {
    const known = [...viewer.rest.pictures.thermal.counts].filter(c => c).sort((a, b) => a - b), at = share => fromKelvin(levelOf(viewer.rest.pictures.thermal, known[Math.floor(share * (known.length - 1))]));
    for (const [id, share] of [["iso-low", .4], ["iso-high", .8]]) { $(id).value = at(share); $(id).oninput(); }
  })())");
  std::vector<int> counts;
  for (const char* way : {"above", "below", "between"}) {
    page.evaluate(std::string("$('isotherm').value = '") + way + "'; $('isotherm').onchange()");
    const json seen = page.evaluate(marked);
    ASSERT_EQ(seen[2], true);
    EXPECT_EQ(seen[0], seen[1]) << way;
    EXPECT_GT(seen[0].get<int>(), 100) << way;
    counts.push_back(seen[0].get<int>());
  }
  EXPECT_LT(counts[2], std::min(counts[0], counts[1]));
  page.evaluate("$('isotherm').value = 'off'; $('isotherm').onchange()");

  const cv::Rect left(150, 150, 400, 500), right(700, 150, 400, 500);
  const cv::Mat thermal = page.screenshot();
  choose(page, "mix");
  page.evaluate("$('opacity').value = 1; $('opacity').oninput()");
  const cv::Mat opaque = page.screenshot();
  page.evaluate("$('opacity').value = 0; $('opacity').oninput()");
  const cv::Mat clear = page.screenshot();
  choose(page, "visible");
  const cv::Mat visible = page.screenshot();
  EXPECT_GT(difference(opaque, clear, left), 10);
  EXPECT_LT(difference(clear, visible, left), 1);

  page.evaluate("$('compare').click(); $('other').value = 'thermal'; $('other').onchange()");
  EXPECT_TRUE(rests(page));
  const cv::Mat both = kept("swipe", page.screenshot());
  EXPECT_LT(difference(both, visible, left), 1);
  EXPECT_LT(difference(both, thermal, right), 2);
  page.drag(640, 300, 1200, 300);  // the line
  EXPECT_LT(difference(page.screenshot(), visible, right), 1);
  EXPECT_TRUE(page.errors().empty()) << page.errors().front();
}

/// What was typed stays the temperature that it was.
TEST_F(ViewBrowserTest, TypedTemperaturesFollowTheUnit) {
  Browser page(folder.path() / "profile", 640, 480, false);
  open(page, url);
  const auto unit = [&](const std::string& chosen) {
    page.evaluate("$('unit').value = '" + chosen + "'; $('unit').onchange()");
    return page.evaluate("[$('reflected').value, $('air').value, $('recorded-reflected').value]");
  };
  page.evaluate("$('reflected').value = '20'; $('air').value = 'cold'");
  EXPECT_EQ(unit("F"), (json{"68", "cold", ""}));
  EXPECT_EQ(page.evaluate("$('reflected').parentElement.textContent"), "reflected, °F ");
  EXPECT_EQ(unit("K"), (json{"293.15", "cold", ""}));
  page.evaluate("$('air').value = '278.15'");
  EXPECT_NEAR(page.evaluate("viewer.measuring.parameters().object.reflected_k").get<double>(),
              293.15, 1e-9);
  EXPECT_EQ(unit("C"), (json{"20", "5", ""}));
  EXPECT_EQ(page.evaluate("$('air').parentElement.textContent"), "air, °C ");
  EXPECT_TRUE(page.errors().empty()) << page.errors().front();
}

/// Two views that are kept, and a film from the one to the other, with its progress.
TEST_F(ViewBrowserTest, AFilmGoesAlongTheKeptViews) {
  Browser page(folder.path() / "profile", 640, 480, false);
  open(page, url);
  EXPECT_EQ(page.evaluate("$('film').disabled"), true);
  for (const char* layer : {"mix", "fused"}) {
    choose(page, layer);
    EXPECT_EQ(page.evaluate("$('film-layer').hidden"), std::string(layer) == "fused")
        << "the overlay's film is another layer's, which is said";
  }
  for (const char* name : {"one", "two"}) {
    page.evaluate(std::string("$('bookmark-name').value = '") + name + "'; $('bookmark').click()");
    ASSERT_TRUE(
        page.becomes("(viewer.bookmarks || []).some(v => v.name === '" + std::string(name) + "')"));
    page.drag(320, 240, 330, 240);
  }
  page.evaluate(
      "viewer.rest.size = () => [96, 72]; $('film-kind').value = 'png'; "
      "$('film').click()");
  ASSERT_TRUE(page.becomes("!$('film-progress').hidden && $('film-progress').max > 1"))
      << page.evaluate("$('film-words').textContent");
  ASSERT_TRUE(page.becomes("$('film-words').textContent.startsWith('made: ')", 300))
      << page.evaluate("$('film-words').textContent");
  int pictures = 0;
  for (const auto& entry : fs::recursive_directory_iterator(out / "films"))
    pictures += entry.path().extension() == ".png" && !cv::imread(entry.path().string()).empty();
  EXPECT_EQ(page.evaluate("$('film-progress').max"), pictures);
  EXPECT_TRUE(page.errors().empty()) << page.errors().front();
}

}  // namespace
}  // namespace orbitfuse::view
