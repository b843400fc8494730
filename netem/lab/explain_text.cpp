#include "netem/lab/explain_text.hpp"

#include <cmath>
#include <iomanip>
#include <ostream>
#include <sstream>

#include "common/config/json.hpp"

namespace farhand {
namespace {

std::string text(const Cost& cost) {
  if (!std::isfinite(cost.ns_per_tick)) return "-";
  std::ostringstream out;
  out << std::fixed << std::setprecision(cost.ns_per_tick < 100 ? 1 : 0) << cost.ns_per_tick << " (" << cost.low << ".."
      << cost.high << ')';
  return out.str();
}

Json json_of(const Cost& cost) {
  if (!std::isfinite(cost.ns_per_tick)) return {};
  return Json::object({{"ns_per_tick", cost.ns_per_tick}, {"lower_quartile", cost.low}, {"upper_quartile", cost.high}});
}

void row(std::ostream& out, const std::string& place, const std::string& name, const Cost& cost, std::size_t bytes,
         const std::string& reason) {
  out << "  " << std::left << std::setw(20) << place << std::setw(24) << name << std::right << std::setw(24)
      << text(cost) << std::setw(8) << (bytes > 0 ? std::to_string(bytes) : "-") << "  " << reason << '\n';
}

void total(std::ostream& out, const char* name, const Cost& cost, std::size_t bytes, const char* what) {
  row(out, "", name, cost, bytes, what);
}

Json json_of(std::size_t bytes, const Cost& cost) {
  return Json::object({{"bytes", bytes}, {"wall_clock", json_of(cost)}});
}

Json json_of(const LawSize& law) {
  return Json::object({{"architecture", std::string(law.name)},
                       {"bytes", law.bytes},
                       {"bytes_of_blocks", law.of_blocks},
                       {"wall_clock", json_of(law.cost)}});
}

}  // namespace

void print_explanation(const Explanation& e, std::ostream& out) {
  out << "Contains" << std::setw(62) << "ns per tick" << std::setw(8) << "bytes"
      << "  because\n";
  for (const Block& block : e.blocks) {
    if (block.contained) row(out, name_of(block.place), block.name, block.cost, block.bytes, block.reason);
  }
  out << "\nAltogether\n";
  const auto law = [&out](const char* name, const LawSize& size) {
    row(out, "", name, size.cost, size.bytes,
        std::string(size.name) + ", " + std::string(size.source) + "; its blocks " + std::to_string(size.of_blocks) +
            " bytes");
  };
  law("law of the master", e.master_law);
  law("law of the slave", e.slave_law);
  total(out, "station of the master", e.master_station, e.master_station_bytes, "receives, ticks, sends");
  total(out, "station of the slave", e.slave_station, e.slave_station_bytes, "receives, ticks, sends");
  total(out, "master with its world", e.master_side, e.master_side_bytes,
        "a tick of the side, its simulated device included");
  total(out, "slave with its world", e.slave_side, e.slave_side_bytes,
        "a tick of the side, its simulated device included");
  total(out, "run in virtual time", e.run, 0, "both sides, codec and link");
  out << "\nLeaves out\n";
  for (const Block& block : e.blocks) {
    if (block.contained) continue;
    out << "  " << std::left << std::setw(20) << name_of(block.place) << std::setw(24) << block.name << std::right
        << block.reason << '\n';
  }
  if (!e.plants.empty()) out << "\nIntegrators\n";
  for (const PlantChoice& plant : e.plants) {
    out << "  " << std::left << std::setw(20) << plant.plant << std::setw(24) << plant.method << std::right
        << plant.because << '\n';
  }
  for (const Block& block : e.blocks) {
    if (!block.needless.empty())
      out << "\nWarning: " << name_of(block.place) << ", " << block.name << ": " << block.needless << '\n';
  }
  out << "\nTimes are of this call: median (quartiles) of batches on the scene's own motion.\n";
}

std::string json_text(const Explanation& e) {
  Json blocks = Json::array(), plants = blocks, warnings = blocks;
  for (const Block& block : e.blocks) {
    Json one = Json::object({{"place", name_of(block.place)},
                             {"name", block.name},
                             {"contained", block.contained},
                             {"reason", block.reason}});
    if (block.contained) {
      one.set("bytes", block.bytes);
      one.set("wall_clock", json_of(block.cost));
    }
    if (!block.needless.empty()) {
      one.set("needless", block.needless);
      warnings.push_back(std::string(name_of(block.place)) + ", " + block.name + ": " + block.needless);
    }
    blocks.push_back(one);
  }
  for (const PlantChoice& p : e.plants) {
    plants.push_back(Json::object({{"plant", p.plant},
                                   {"asked", p.asked},
                                   {"method", p.method},
                                   {"step_s", p.step_s},
                                   {"largest_rate_per_s", p.largest_rate_per_s},
                                   {"rate_times_step", p.rate_times_step},
                                   {"limit", p.limit},
                                   {"because", p.because}}));
  }
  const Json all = Json::object({{"scene", e.scene},
                                 {"blocks", blocks},
                                 {"integrators", plants},
                                 {"warnings", warnings},
                                 {"master_law", json_of(e.master_law)},
                                 {"slave_law", json_of(e.slave_law)},
                                 {"master_station", json_of(e.master_station_bytes, e.master_station)},
                                 {"slave_station", json_of(e.slave_station_bytes, e.slave_station)},
                                 {"master_side", json_of(e.master_side_bytes, e.master_side)},
                                 {"slave_side", json_of(e.slave_side_bytes, e.slave_side)},
                                 {"run", Json::object({{"wall_clock", json_of(e.run)}})}});
  return all.dump(2);
}

}  // namespace farhand
