#include "common/runtime/command.hpp"

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "common/files/output.hpp"
#include "common/files/utf8.hpp"

namespace farhand {

struct NamedFiles {
  enum class Use : std::uint8_t { kInput, kOutput, kOutputDirectory };
  struct Named {
    const CLI::App* command;
    std::string option;
    const std::string* file;
    Use use;
  };
  std::vector<Named> all;
};

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

// What a shell makes of a variable that is not set would take a stop, a key or a recording away.
void require_no_empty(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument.empty()) {
      const bool follows = i > 1 && argv[i - 1][0] == '-';
      throw std::invalid_argument(follows ? std::string(argv[i - 1]) + " is given nothing, an empty text"
                                          : std::string("an argument is empty"));
    }
    if (argument.starts_with("--") && argument.ends_with('='))
      throw std::invalid_argument(std::string(argument.substr(0, argument.size() - 1)) +
                                  " is given nothing, an empty text");
  }
}

void require_utf8(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    if (!is_utf8(argv[i])) {
      throw std::invalid_argument("'" + as_utf8(argv[i]) +
                                  "' is not UTF-8; arguments and names of files must be, for recordings and reports "
                                  "hold them");
    }
  }
}

// A name that a shell has made out of nothing, or of two options, is found before anything is written.
void require_files(const NamedFiles& files) {
  using Use = NamedFiles::Use;
  std::vector<NamedFiles::Named> given;
  for (const NamedFiles::Named& named : files.all) {
    if (named.command->parsed() && !named.file->empty() && *named.file != "-") given.push_back(named);
  }
  for (auto output = given.begin(); output != given.end(); ++output) {
    if (output->use == Use::kInput) continue;
    for (auto other = given.begin(); other != given.end(); ++other) {
      const bool both_made = other->use != Use::kInput;
      if (other == output || (both_made && other > output)) continue;
      if (*other->file == *output->file || same_on_disk(*other->file, *output->file)) {
        throw std::invalid_argument(output->option + " " + *output->file + " is the same file as " + other->option +
                                    " " + *other->file +
                                    (both_made ? ": each needs one of its own" : ": what is read is never written"));
      }
    }
    if (output->use == Use::kOutput) require_output(*output->file);
    if (output->use == Use::kOutputDirectory) require_output_directory(*output->file);
  }
}

}  // namespace

Command Command::subcommand(const char* name, const char* purpose) {
  return {app_->add_subcommand(name, purpose), files_};
}
void Command::require_subcommand() { app_->require_subcommand(1); }

void Command::text(const char* name, std::string& value, const char* meaning, Needed needed) {
  require(app_->add_option(name, value, meaning), needed);
}
void Command::input(const char* name, std::string& value, const char* meaning, Needed needed) {
  text(name, value, meaning, needed);
  files_->all.push_back({app_, name, &value, NamedFiles::Use::kInput});
}
void Command::output(const char* name, std::string& value, const char* meaning) {
  text(name, value, meaning);
  files_->all.push_back({app_, name, &value, NamedFiles::Use::kOutput});
}
void Command::output_directory(const char* name, std::string& value, const char* meaning) {
  text(name, value, meaning);
  files_->all.push_back({app_, name, &value, NamedFiles::Use::kOutputDirectory});
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
  // Else -1 would be the largest number that there is.
  app_->add_option(name, value, meaning)->check([](const std::string& given) {
    return given.starts_with('-') ? given + " is not allowed; give a whole number from 0" : std::string();
  });
}
void Command::flag(const char* name, bool& value, const char* meaning) { app_->add_flag(name, value, meaning); }

void Command::alone(const char* name) {
  CLI::Option* option = app_->get_option(name);
  for (CLI::Option* other : app_->get_options()) {
    if (other != option && other != app_->get_help_ptr()) option->excludes(other);
  }
}

void Command::epilogue(const std::string& text) { app_->footer(text); }

bool Command::given() const { return app_->parsed(); }

Program::Program(const std::string& name, const std::string& purpose)
    : app_(new CLI::App(purpose, name)), files_(std::make_unique<NamedFiles>()) {}
Program::~Program() { delete app_; }

int Program::run(int argc, char** argv, const std::function<int()>& body) {
  const std::string name = app_->get_name();
  for (const int signal : {SIGXFSZ, SIGPIPE}) std::signal(signal, SIG_IGN);
  try {
    require_utf8(argc, argv);
    require_no_empty(argc, argv);
    app_->parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app_->exit(help);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "%s: %s (--help lists the options)\n", name.c_str(), error.what());
    return kExitUsage;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), error.what());
    return kExitUsage;
  }
  try {
    require_files(*files_);
    return body();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), error.what());
    return kExitUsage;
  }
}

}  // namespace farhand
