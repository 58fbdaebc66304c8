// SPDX-License-Identifier: Apache-2.0
#include <fmt/ranges.h>

#include <algorithm>
#include <iostream>

#include "apps/command.h"
#include "apps/words/completion.h"
#include "apps/words/man_page.h"
#include "apps/words/option_words.h"
#include "apps/words/usage.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

struct HelpArguments {
  std::vector<std::string> command;
  fs::path folder;
};

void WriteManPages(const CLI::App& command, const fs::path& folder) {
  WriteFileAtomically(folder / (ManPageName(command) + ".1"), ManPage(command));
  for (const CLI::App* below : CommandsOf(command)) WriteManPages(*below, folder);
}

// The folders are those that man, bash-completion and zsh look into below /usr/share or ~/.local/share.
void Write(const CLI::App& app, const fs::path& folder, const Context& context) {
  WriteManPages(app, folder / "man/man1");
  WriteFileAtomically(folder / "bash-completion/completions/polarscan", BashCompletion(app));
  WriteFileAtomically(folder / "zsh/vendor-completions/_polarscan", ZshCompletion(app));
  context.Finish({{"folder", folder}},
                 fmt::format("man pages and completion for bash and zsh: {}", folder.string()));
}

const CLI::App& Find(const CLI::App& app, const std::vector<std::string>& path) {
  const CLI::App* command = &app;
  for (const std::string& name : path) {
    const std::vector<const CLI::App*> below = CommandsOf(*command);
    const auto found = std::ranges::find(below, name, &CLI::App::get_name);
    if (found == below.end()) throw CLI::ConfigError(NoSuchCommand(*command, name));
    command = *found;
  }
  return *command;
}

}  // namespace

void AddHelpCommand(CLI::App& app, Context& context) {
  auto a = std::make_shared<HelpArguments>();
  CLI::App* command = app.add_subcommand("help", "The help of a command; man pages and completion as files");
  command->add_option("COMMAND", a->command, "As in polarscan help stereo");
  command
      ->add_option("--write", a->folder,
                   "Write man pages and completion of bash and zsh below this folder, say ~/.local/share")
      ->type_name("FOLDER");
  AddExample(*command, "  polarscan help stereo\n  polarscan help --write ~/.local/share");
  command->callback([a, &app, &context] {
    if (!a->folder.empty()) return Write(app, a->folder, context);
    const CLI::App& found = Find(app, a->command);
    const std::string path = fmt::format("{}", fmt::join(PathOf(found), " "));
    std::cout << app.get_formatter()->make_help(&found, path, CLI::AppFormatMode::Normal) << std::flush;
  });
}

}  // namespace polarscan
