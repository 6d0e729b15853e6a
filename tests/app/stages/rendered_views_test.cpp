// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/rendered_views.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/stages/artifacts.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse::stages {
namespace {
using testing::HasSubstr;

TEST(RenderedViews, SayWhatTheirThermalFilesHold) {
  const test::TempFolder temp;
  for (const bool gray : {false, true}) {
    RenderedViews rendered;
    rendered.thermal_is_gray = gray;
    rendered.heat = {10, 1, 100};
    ASSERT_TRUE(save_rendered_views(temp.path(), rendered));
    const auto j = read_json(temp.path() / "views.json");
    ASSERT_TRUE(j);
    EXPECT_THAT(j->at("conventions").get<std::string>(),
                HasSubstr(gray ? "8-bit gray levels, no temperatures" : "16-bit, kelvin ="));
    EXPECT_EQ(load_rendered_views(temp.path())->thermal_is_gray, gray);
  }
}

}  // namespace
}  // namespace orbitfuse::stages
