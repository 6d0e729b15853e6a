// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/page.hpp"

#include <cassert>
#include <string_view>

namespace orbitfuse {
namespace embedded {
extern const std::string_view view_html, view_css, view_three, view_orbit_controls;
extern const std::string_view view_units_js, view_thermal_js, view_scene_js, view_layers_js,
    view_panels_js, view_measure_js, view_main_js, view_keeping_js;
}  // namespace embedded

namespace view {
namespace {

void fill(std::string& page, std::string_view mark, const std::string& text) {
  const std::size_t at = page.find(mark);
  assert(at != std::string::npos);
  page.replace(at, mark.size(), text);
}

std::string script(std::string_view text) { return "<script>" + std::string(text) + "</script>\n"; }

}  // namespace

std::string page_html() {
  using namespace embedded;
  std::string page(view_html), scripts;
  for (const std::string_view text :
       {view_three, view_orbit_controls, view_units_js, view_thermal_js, view_scene_js,
        view_layers_js, view_panels_js, view_measure_js, view_main_js, view_keeping_js})
    scripts += script(text);
  fill(page, "/*STYLE*/", std::string(view_css));
  fill(page, "<!--SCRIPTS-->", scripts);
  return page;
}

}  // namespace view
}  // namespace orbitfuse
