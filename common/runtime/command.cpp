#include "common/runtime/command.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <sstream>

namespace farhand {
namespace {

void require(CLI::Option* option, Needed needed) {
  if (needed == Needed::kYes) option->required();
}

// What the text must be, or nothing if it is.
template <class T>
CLI::Option* add_ranged(CLI::App& app, const char* name, T& value, T min, T max, const char* meaning) {
  return app.add_option(name, value, meaning)->check([min, max](const std::string& text) {
    T number{};
    if (CLI::detail::lexical_cast(text, number) && number >= min && number <= max) return std::string();
    std::ostringstream wrong;
    wrong << '\'' << text << "' is not a number from " << min << " to " << max;
    return wrong.str();
  });
}

}  // namespace

Command Command::subcommand(const char* name, const char* purpose) {
  return Command(app_->add_subcommand(name, purpose));
}
void Command::require_subcommand() { app_->require_subcommand(1); }

void Command::text(const char* name, std::string& value, const char* meaning, Needed needed) {
  require(app_->add_option(name, value, meaning), needed);
}
void Command::texts(const char* name, std::vector<std::string>& values, const char* meaning, Needed needed) {
  CLI::Option* option = app_->add_option(name, values, meaning);
  if (!option->get_positional()) option->allow_extra_args(false);
  require(option, needed);
}
void Command::number(const char* name, double& value, double min, double max, const char* meaning) {
  add_ranged(*app_, name, value, min, max, meaning);
}
void Command::count(const char* name, int& value, int min, int max, const char* meaning) {
  add_ranged(*app_, name, value, min, max, meaning);
}
void Command::seed(const char* name, std::optional<std::uint64_t>& value, const char* meaning) {
  app_->add_option(name, value, meaning);
}
void Command::flag(const char* name, bool& value, const char* meaning) { app_->add_flag(name, value, meaning); }

void Command::epilogue(const std::string& text) { app_->footer(text); }

bool Command::given() const { return app_->parsed(); }

Program::Program(const std::string& name, const std::string& purpose) : app_(new CLI::App(purpose, name)) {}
Program::~Program() { delete app_; }

int Program::run(int argc, char** argv, const std::function<int()>& body) {
  const std::string name = app_->get_name();
  try {
    app_->parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app_->exit(help);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "%s: %s (--help lists the options)\n", name.c_str(), error.what());
    return kExitUsage;
  }
  try {
    return body();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), error.what());
    return kExitUsage;
  }
}

}  // namespace farhand
