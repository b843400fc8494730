#include "netem/lab/compare.hpp"

#include <google/protobuf/util/message_differencer.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "common/record/merge.hpp"
#include "common/runtime/program.hpp"
#include "netem/lab/simulation.hpp"

namespace farhand {
namespace {

namespace fs = std::filesystem;

// What a session is made from.
struct Source {
  std::string asked;
  std::string name;
  LoadedScene loaded;  // still empty for a directory
  bool directory = false;
};

std::string name_of_directory(const std::string& directory) {
  const fs::path path = fs::absolute(directory).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

// SCENE,field.path=value,...
std::vector<std::string> parted(const std::string& asked) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0, end = 0; begin <= asked.size(); begin = end + 1) {
    end = std::min(asked.find(',', begin), asked.size());
    parts.push_back(asked.substr(begin, end - begin));
  }
  return parts;
}

Source source_of(const std::string& asked, const ComparisonAsked& all) {
  if (fs::is_directory(asked)) return {asked, name_of_directory(asked), {}, true};
  const bool scene_file = asked.ends_with(".txtpb");
  if (!scene_file && (asked.find('/') != std::string::npos || asked.ends_with(".mcap"))) {
    const char* what = fs::exists(asked) ? ": not a directory; a session is the directory that holds its recordings"
                                         : ": there is no such directory";
    throw std::invalid_argument(asked + what);
  }
  const std::vector<std::string> parts = parted(asked);
  std::vector<std::string> sets = all.sets;
  sets.insert(sets.end(), parts.begin() + 1, parts.end());
  Source source{asked, "", SceneChoice{parts.front(), sets, all.seed}.load(), false};
  source.name = source.loaded.name;
  for (std::size_t k = 1; k < parts.size(); ++k) source.name += (k == 1 ? " " : ", ") + parts[k];
  return source;
}

ComparedSession compared(const std::string& name, const Session& session, LoadedScene loaded) {
  Metrics metrics = compute_metrics(session, loaded.scene);
  AlignedSession curves = align(session, loaded.scene);
  return {name, session.deterministic, std::move(loaded), std::move(metrics), std::move(curves)};
}

ComparedSession read(const Source& source) {
  const Session session = merge_recordings(source.asked);
  LoadedScene loaded = load_scene_text(session.scene_text, source.asked + "/scene.txtpb");
  loaded.name = session.scene_name;
  return compared(source.name, session, std::move(loaded));
}

// Without what cannot change a number in virtual time.
scene::Scene settings_of(const ComparedSession& session) {
  scene::Scene scene = session.loaded.scene;
  scene.clear_runtime();
  scene.clear_description();
  return scene;
}

// Empty if they are the same.
std::string settings_that_differ(const ComparedSession& from, const ComparedSession& to) {
  google::protobuf::util::MessageDifferencer differencer;
  std::string lines, out;
  differencer.ReportDifferencesToString(&lines);
  if (differencer.Compare(settings_of(from), settings_of(to))) return "";
  for (std::size_t begin = 0, end = 0; begin < lines.size(); begin = end + 1) {
    end = std::min(lines.find('\n', begin), lines.size());
    out += (out.empty() ? "" : "; ") + lines.substr(begin, end - begin);
  }
  return out;
}

void refuse_two_of_a_name(const std::vector<ComparedSession>& sessions) {
  for (auto a = sessions.begin(); a != sessions.end(); ++a) {
    const bool twice = std::any_of(
        sessions.begin(), a, [&](const ComparedSession& b) { return b.name == a->name && b.in_lab == a->in_lab; });
    if (twice)
      throw std::invalid_argument("two sessions of " + std::string(a->in_lab ? "the lab" : "processes") +
                                  " are called " + a->name + "; each needs a name of its own");
  }
}

}  // namespace

std::vector<ComparedSession> compared_sessions(const ComparisonAsked& asked) {
  std::vector<ComparedSession> out;
  std::vector<bool> to_run;  // beside each
  const auto add = [&](ComparedSession session, bool run) {
    out.push_back(std::move(session));
    to_run.push_back(run);
  };
  std::vector<Source> sources;
  for (const std::string& one : asked.sessions) sources.push_back(source_of(one, asked));
  const bool scenes = std::any_of(sources.begin(), sources.end(), [](const Source& s) { return !s.directory; });
  if (!scenes && (!asked.sets.empty() || asked.seed))
    throw std::invalid_argument("--set and --seed change scenes, and only directories are given");
  std::vector<ComparedSession> of_lab;  // not yet run
  for (const Source& source : sources)
    if (!source.directory) of_lab.push_back({source.name, true, source.loaded, {}, {}});
  for (const Source& source : sources) {
    if (!source.directory) {
      add({source.name, true, source.loaded, {}, {}}, true);
      continue;
    }
    add(read(source), false);
    if (!asked.lab || out.back().in_lab) continue;
    const bool there = std::any_of(of_lab.begin(), of_lab.end(), [&](const ComparedSession& lab) {
      return settings_that_differ(lab, out.back()).empty();
    });
    if (there) continue;
    of_lab.push_back({source.name, true, out.back().loaded, {}, {}});
    add(of_lab.back(), true);
  }
  refuse_two_of_a_name(out);
  for (std::size_t k = 0; k < out.size(); ++k)
    if (to_run[k]) out[k] = compared(out[k].name, simulate(out[k].loaded), out[k].loaded);
  return out;
}

std::vector<SteadyDifference> steady_differences(const std::vector<ComparedSession>& sessions) {
  std::vector<SteadyDifference> out;
  for (std::size_t p = 0; p < sessions.size(); ++p) {
    if (sessions[p].in_lab) continue;
    std::vector<SteadyDifference> same, named_alike;
    for (std::size_t l = 0; l < sessions.size(); ++l) {
      if (!sessions[l].in_lab) continue;
      const std::string differs = settings_that_differ(sessions[l], sessions[p]);
      if (!differs.empty()) {
        if (sessions[l].loaded.name == sessions[p].loaded.name)
          named_alike.push_back({p, l, kAbsent, "their settings differ: " + differs});
        continue;
      }
      SteadyDifference pair{p, l, 0.0, ""};
      for (const std::size_t k : {p, l}) {
        const Metric& ratio = sessions[k].metrics.at("force_ratio");
        if (!ratio.absent_because.empty()) pair.absent_because = ratio.absent_because;
      }
      pair.force_ratio =
          sessions[p].metrics.number("force_ratio") - sessions[l].metrics.number("force_ratio");  // NaN if absent
      same.push_back(pair);
    }
    const auto& told = same.empty() ? named_alike : same;
    out.insert(out.end(), told.begin(), told.end());
  }
  return out;
}

}  // namespace farhand
