// SPDX-License-Identifier: BSD-3-Clause
#include "recon/measurement/request.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace orbitfuse::measurement {
namespace {
using nlohmann::json;
using testing::HasSubstr;

json pixel(double u, double v) { return {{"view", "000"}, {"u", u}, {"v", v}}; }

TEST(MeasurementRequest, EveryKindGoesThroughJsonUnchanged) {
  const json point = {{"point", {1.5, -2, 0.25}}};
  const json requests[] = {
      {{"kind", "spot"}, {"name", "valve"}, {"places", {pixel(3.5, 4)}}},
      {{"kind", "spot"},
       {"places", {point}},
       {"object", {{"emissivity", 0.5}, {"reflected_k", 280}, {"distance_m", 3.0}}},
       {"recorded", {{"emissivity", 0.95}}}},
      {{"kind", "box"},
       {"box", {{"center", {0, 0, 1}}, {"size", {1, 2, 3}}, {"rotation_wxyz", {1, 0, 0, 0}}}}},
      {{"kind", "line"}, {"places", {point, pixel(1, 2)}}, {"profile", 12}},
      {{"kind", "polygon"}, {"places", {pixel(0, 0), pixel(5, 0), pixel(5, 5)}}},
      {{"kind", "polygon"}, {"places", {point, point, point}}},
      {{"kind", "hottest"}, {"count", 3}, {"apart", 0.25}},
      {{"kind", "coldest"}, {"count", 1}},
      {{"kind", "distance"}, {"places", {point, point}}},
      {{"kind", "difference"},
       {"of", {{{"kind", "spot"}, {"places", {point}}}, {{"kind", "hottest"}, {"count", 1}}}}}};
  for (const json& given : requests) {
    const auto request = request_of_json(given);
    ASSERT_TRUE(request) << request.error().message();
    EXPECT_EQ(to_json(*request), given);
  }
}

TEST(MeasurementRequest, WhatIsWrongIsNamed) {
  const json point = {{"point", {0, 0, 0}}};
  const double inf = std::numeric_limits<double>::infinity();
  struct Case {
    json request;
    const char* named;
  };
  const Case cases[] = {
      {json::array(), "measurement"},
      {{{"kind", "spott"}}, "kind"},
      {{{"places", {point}}}, "kind"},
      {{{"kind", "spot"}}, "spot"},
      {{{"kind", "spot"}, {"places", {point, point}}}, "spot"},
      {{{"kind", "spot"}, {"places", 3}}, "places"},
      {{{"kind", "spot"}, {"places", {{{"point", {0, 0}}}}}}, "point"},
      {{{"kind", "spot"}, {"places", {{{"point", {0, 0, inf}}}}}}, "point"},
      {{{"kind", "spot"}, {"places", {{{"point", {0, 0, 1e300}}}}}}, "point"},
      {{{"kind", "spot"}, {"places", {{{"u", 3}, {"v", 4}}}}}, "view"},
      {{{"kind", "spot"}, {"places", {pixel(-1, 4)}}}, "u"},
      {{{"kind", "spot"}, {"places", {point}}, {"emisivity", 1}}, "emisivity"},
      {{{"kind", "spot"}, {"places", {point}}, {"object", {{"emissivity", 0}}}}, "emissivity"},
      {{{"kind", "spot"}, {"places", {point}}, {"object", {{"emissivity", "x"}}}}, "emissivity"},
      {{{"kind", "spot"}, {"places", {point}}, {"object", {{"reflected_k", -5}}}}, "reflected_k"},
      {{{"kind", "box"}}, "size"},
      {{{"kind", "box"}, {"box", {{"center", {0, 0, 0}}, {"size", {1, 0, 1}}}}}, "size"},
      {{{"kind", "box"},
        {"box", {{"center", {0, 0, 0}}, {"size", {1, 1, 1}}, {"rotation_wxyz", {0, 0, 0, 0}}}}},
       "rotation_wxyz"},
      {{{"kind", "polygon"}, {"places", {pixel(0, 0), pixel(1, 1)}}}, "polygon"},
      {{{"kind", "polygon"}, {"places", {pixel(0, 0), pixel(1, 1), point}}}, "polygon"},
      {{{"kind", "polygon"}, {"places", {point, pixel(0, 0), pixel(1, 1)}}}, "polygon"},
      {{{"kind", "line"}, {"places", {point, point}}, {"profile", 1}}, "profile"},
      {{{"kind", "hottest"}, {"count", 0}}, "count"},
      {{{"kind", "hottest"}, {"count", 2.5}}, "count"},
      {{{"kind", "hottest"}, {"count", 1}, {"apart", -1}}, "apart"},
      {{{"kind", "difference"}, {"of", {{{"kind", "hottest"}}}}}, "difference"},
      {{{"kind", "spot"}, {"places", {{{"point", {0, 0, 0}}, {"view", "000"}}}}}, "view"},
      {{{"kind", "spot"}, {"places", {{{"point", {0, 0, 0}}, {"u", 3}}}}}, "u"},
      {{{"kind", "difference"},
        {"of", {{{"kind", "hottest"}}, {{"kind", "coldest"}}}},
        {"object", {{"emissivity", 0.5}}}},
       "measure.object"},
      {{{"kind", "difference"},
        {"of", {{{"kind", "hottest"}}, {{"kind", "coldest"}}}},
        {"recorded", {{"emissivity", 0.5}}}},
       "measure.recorded"},
      {{{"kind", "difference"},
        {"of", {{{"kind", "hottest"}}, {{"kind", "distance"}, {"places", {point, point}}}}}},
       "difference"}};
  for (const Case& c : cases) {
    const auto request = request_of_json(c.request);
    ASSERT_FALSE(request) << c.request.dump();
    EXPECT_EQ(request.error().kind, ErrorKind::usage);
    EXPECT_THAT(request.error().where, HasSubstr(c.named)) << c.request.dump();
    EXPECT_FALSE(request.error().remedy.empty());
  }
}

TEST(MeasurementRequest, DifferencesDoNotNest) {
  json nested = {{"kind", "hottest"}};
  for (int i = 0; i < 3; ++i) nested = {{"kind", "difference"}, {"of", {nested, nested}}};
  EXPECT_FALSE(request_of_json(nested));
}

}  // namespace
}  // namespace orbitfuse::measurement
