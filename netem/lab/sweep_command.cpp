#include "netem/lab/sweep_command.hpp"

#include <charconv>
#include <chrono>
#include <iomanip>
#include <iostream>
#include <thread>

#include "common/config/schema.hpp"
#include "netem/lab/sweep.hpp"
#include "netem/lab/write_to.hpp"

namespace farhand {
namespace {

// field=from:to:count, both ends included.
struct SweptField {
  std::string name;
  double from, to;
  std::size_t count;

  double at(std::size_t k) const {
    return count > 1 ? from + (to - from) * static_cast<double>(k) / static_cast<double>(count - 1) : from;
  }
};

bool number(std::string_view text, auto& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

// False: an ordinary setting.
bool parse_range(const std::string& set, SweptField& field) {
  const std::size_t equals = set.find('='), first = set.find(':', equals), second = set.find(':', first + 1);
  if (equals == std::string::npos || first == std::string::npos || second == std::string::npos) return false;
  const std::string_view all(set);
  field.name = set.substr(0, equals);
  return number(all.substr(equals + 1, first - equals - 1), field.from) &&
         number(all.substr(first + 1, second - first - 1), field.to) && number(all.substr(second + 1), field.count) &&
         field.count > 0;
}

}  // namespace

Command add_sweep(Command program, SweepChoice& choice) {
  Command command = program.subcommand(
      "sweep", "a scene over ranges of its settings, in the bare loop and on all cores; --set field=from:to:count");
  add_scene_argument(command, choice.scene);
  command.count("--threads", choice.threads, 0, 1024, "0: one per core; the results are the same for any number");
  command.output("--csv", choice.csv, "table of the results (default - is standard output)");
  return command;
}

int run_sweep(const SweepChoice& choice) {
  std::vector<SweptField> fields;
  std::vector<std::string> sets;
  for (const std::string& set : choice.scene.sets) {
    SweptField field;
    if (parse_range(set, field)) {
      fields.push_back(field);
    } else {
      sets.push_back(set);
    }
  }
  std::size_t count = 1;
  for (const SweptField& field : fields) {
    if (field.count > 10'000'000 / count) throw std::invalid_argument("a sweep has at most 10 million scenes");
    count *= field.count;
  }
  // The last field runs fastest.
  const auto values = [&fields](std::size_t k) {
    std::vector<double> out(fields.size());
    for (std::size_t i = fields.size(); i-- > 0; k /= fields[i].count) out[i] = fields[i].at(k % fields[i].count);
    return out;
  };
  const auto scene_of = [&](std::size_t k) {
    std::vector<std::string> all = sets;
    const std::vector<double> at = values(k);
    for (std::size_t i = 0; i < fields.size(); ++i) all.push_back(fields[i].name + "=" + shortest(at[i]));
    return load_scene(choice.scene.scene, all, choice.scene.seed).scene;
  };
  scene_of(0), scene_of(count - 1);  // mistakes are said before anything runs

  const int threads = choice.threads > 0 ? choice.threads : static_cast<int>(std::thread::hardware_concurrency());
  const auto begin = std::chrono::steady_clock::now();
  const std::vector<SweepOutcome> outcomes = sweep(count, scene_of, std::max(1, threads));
  const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();

  write_to(choice.csv, [&](std::ostream& out) {
    for (const SweptField& field : fields) out << field.name << ',';
    out << "x_m_rad,x_s_rad,f_m_nm,f_s_nm,tracking_rms_rad,residual_p2p_rad,ended\n";
    for (std::size_t k = 0; k < count; ++k) {
      for (const double value : values(k)) out << shortest(value) << ',';
      const SweepOutcome& o = outcomes[k];
      for (const double y : {o.x_m, o.x_s, o.f_m, o.f_s, o.tracking_rms, o.residual}) out << shortest(y) << ',';
      out << (o.failure.empty() ? "ok" : o.failure) << '\n';
    }
  });
  std::cerr << count << " scenes in " << std::setprecision(3) << wall_s << " s on " << threads << " threads, "
            << static_cast<double>(count) / wall_s << " per second with loading\n";
  return kExitOk;
}

}  // namespace farhand
