#include "tests/lab/explain_plants.hpp"

namespace farhand {

void explain_plants(const scene::Scene& /*scene*/, Explanation& /*explanation*/) {}

}  // namespace farhand
