// Scales and quantities as text for readers, independent of the locale of the process; and text that cannot break the
// page into which it is put.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace farhand {

// 1-2-5 ticks within [from, until], about `wanted` of them; decades (with 2 and 5 if they are few) on a log axis.
std::vector<double> ticks(double from, double until, int wanted, bool log);

// As few digits as tell the number apart from its neighbours on a scale with this step.
std::string tick_label(double y, double step);
// On a log axis: 1, 0.01, 1e-8.
std::string decade_label(double y);

// The value in the unit that reads best: rad becomes mrad and degrees, small N m become mN m, shares become percent.
std::string quantity(double y, std::string_view unit);

// For HTML and SVG, in text and in attributes. Control characters and broken UTF-8 are replaced.
std::string escaped(std::string_view text);

}  // namespace farhand
