# SPDX-License-Identifier: Apache-2.0
"""What the documentation tells people to type: every command and option exists, and the tutorials run as they stand, with
smaller pictures. A comment above a block says what is special: <!-- not run: why -->, <!-- may fail: why -->, or the
keys to press, one after the other: <!-- keys: space q -->."""
import collections, os, pty, re, shlex, shutil, signal, subprocess, tempfile, unittest
from pathlib import Path

ROOT, PROGRAM = Path(__file__).parents[2], os.environ["POLARSCAN_PROGRAM"]
BLOCK = re.compile(r"(?:<!-- (not run|may fail|keys: [a-z ]*?)(?::[^\n]*)? -->\n)?```(sh|python)\n(.*?)```", re.S)
SMALLER = [(r"--width \d+ --height \d+", "--width 160 --height 128 --samples 1"), (r'preset="fast"', 'preset="fast", rounds=1'),
           (r"--frames 18", "--frames 4")]


def help_of(path):
    return subprocess.run([PROGRAM, *path, "--help-all"], capture_output=True, text=True, check=True).stdout


def subcommands(text):
    return re.findall(r"^  ([a-z]+) ", text.split("Subcommands:")[1].split("\nExample:")[0], re.M) if "Subcommands:" in text else []


def commands(page):
    """(line number, command) of what a page shows to type: its indented and fenced blocks, and `code` in a sentence."""
    fenced = False
    for number, line in enumerate(page.read_text().splitlines(), 1):
        fenced ^= line.startswith("```")
        for text in [line] if fenced or line.startswith("    ") else re.findall(r"`([^`]+)`", line):
            for command in re.split(r"&&|[|;&()]", re.split(r"\s{3,}|\s# ", text.strip())[0]):
                yield number, re.sub(r"^sudo ", "", command.strip())


class Commands(unittest.TestCase):
    def setUp(self):
        self.known = {}

    def words(self, path):
        """(commands below, options, values of those that take one of a few) of a command, from its --help-all."""
        if path not in self.known:
            text = help_of(path)
            values = {name: values.split(",") for name, values in re.findall(r"(--[a-z][\w-]*) [A-Za-z]*:?\{([\w,-]+)\}", text)}
            self.known[path] = (subcommands(text), set(re.findall(r"(?<![\w-])--?[a-z][\w-]*", text)), values)
        return self.known[path]

    def check(self, line, where):
        """A line without a shell's punctuation. Words in capitals stand for the reader's own."""
        path, option = (), None
        for word in shlex.split(line)[1:]:
            below, options, values = self.words(path)
            before, option = option, None
            if word.startswith("-"):
                option = word.split("=")[0]
                if re.fullmatch(r"--?[A-Za-z][\w-]*", option):
                    self.assertIn(option, options | self.words(())[1], f"{where}: {line}")
                elif before is None:
                    self.assertRegex(option, "^-[0-9]", f"{where}: {line}")
            elif before in values:
                self.assertTrue(word in values[before] or re.search("[A-Z.]", word), f"{where}: {line}: {before} does not take {word}")
            elif word in below:
                path += (word,)
            elif not path and before not in ("--threads", "--seed", "--config"):
                self.assertRegex(word, "^[A-Z.]+$", f"{where}: {line}: no such command")

    def check_script(self, words, where):
        script = ROOT / words[0]
        self.assertTrue(os.access(script, os.X_OK), f"{where}: there is no {words[0]}")
        for word in words[1:]:
            if re.match("--[a-z]", word):
                self.assertIn(word, script.read_text(), f"{where}: {words[0]} has no {word}")
        if script.name == "build" and words[1:] and re.match("[a-z]", words[1]):
            self.assertIn(f'"name": "{words[1]}"', (ROOT / "CMakePresets.json").read_text(), where)

    def test_every_command_and_option_in_the_docs_exists(self):
        count = collections.Counter()
        targets = "".join(path.read_text() for path in ROOT.glob("*/CMakeLists.txt"))
        for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
            for number, command in commands(page):
                where, words = f"{page.name}:{number}", command.split()
                if re.match(r"(\S*/)?polarscan [-A-Za-z]", command):
                    self.check(command, where)
                elif re.match(r"scripts/\w", command):
                    self.check_script(words, where)
                elif re.match(r"cmake --build |build/\w+/bin/", command):
                    for target in re.findall(r"--target (.*)|/bin/([\w-]+)", command)[0]:
                        for name in target.split():
                            self.assertTrue(re.search(rf"\b{name.removesuffix('_test')}\b", targets), f"{where}: no target {name}")
                else:
                    continue
                count[words[0].split("/")[0]] += 1
        for kind, least in {"polarscan": 150, "scripts": 20, "cmake": 3, "build": 2}.items():
            self.assertGreater(count[kind], least, count)

    def test_every_command_shows_an_example_that_exists(self):
        for path in self.all_commands(()):
            examples = re.findall(r"^  (polarscan .*)", help_of(path).split("\nExample:\n")[1], re.M)
            self.assertTrue(any(" ".join(("polarscan",) + path) in line for line in examples), path)
            for line in examples:
                self.check(line, path)

    def test_options_named_in_a_sentence_exist(self):
        everything = "".join(help_of(path) for path in self.all_commands(()))
        everything += "".join(script.read_text() for script in (ROOT / "tools").glob("*.py"))
        options = set(re.findall(r"--[a-z][\w-]*", everything))
        for page in sorted((ROOT / "docs").glob("*.md")):
            if page.name in ("colmap.md", "install.md", "evaluate.md", "results.md", "performance.md", "cluster.md"):
                continue  # they name options of other programs
            named = set(re.findall(r"`(--[a-z][\w-]*)[^`]*`", page.read_text()))
            self.assertEqual(named - options, set(), page.name)

    def all_commands(self, path):
        yield path
        for name in subcommands(help_of(path)):
            yield from self.all_commands(path + (name,))


class Tutorial(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.environment = dict(os.environ, PATH=f"{Path(PROGRAM).parent}:{os.environ['PATH']}")

    def blocks(self, page):
        for remark, language, text in BLOCK.findall((ROOT / "docs" / page).read_text()):
            for pattern, smaller in SMALLER:
                text = re.sub(pattern, smaller, text)
            if remark != "not run":
                yield remark, language, text

    def run_block(self, text, keys):
        command = {"args": ["sh", "-e", "-c", text], "cwd": self.folder, "env": self.environment}
        if not keys:
            return subprocess.run(capture_output=True, text=True, **command)
        terminal, end = pty.openpty()
        child = subprocess.Popen(stdin=end, stdout=end, stderr=end, **command)
        os.close(end)
        said, shown = b"", 0
        try:
            while chunk := os.read(terminal, 65536):
                said += chunk
                if keys and said.count(b"frames/s", shown) > 2:  # the line of numbers lives
                    os.write(terminal, {"space": b" "}.get(keys[0], keys[0].encode()))
                    keys, shown = keys[1:], len(said)
        except OSError:  # the terminal's other end is closed
            pass
        os.close(terminal)
        return subprocess.CompletedProcess(text, child.wait(60), said.decode(errors="replace"), "")

    def run_page(self, page, language):
        ran = 0
        for remark, kind, text in self.blocks(page):
            if kind != language:
                continue
            done = self.run_block(text, remark.removeprefix("keys: ").split() if remark.startswith("keys") else [])
            if remark != "may fail":
                self.assertEqual(done.returncode, 0, f"{page}: {text}\n{done.stdout}\n{done.stderr}")
            ran += 1
        return ran


class TutorialPictures(Tutorial):
    def test_the_first_tutorial_and_then_the_page_about_python_run(self):
        self.assertGreater(self.run_page("tutorial-pictures.md", "sh"), 5)
        for name in ("scan/report.html", "scan/cloud.ply", "scan/mesh.ply", "bear.glb", "scan2/cloud.ply"):
            self.assertTrue((self.folder / name).exists(), name)
        script = "\n".join(text for _, kind, text in self.blocks("python.md") if kind == "python")
        self.assertGreater(len(script), 500)
        try:
            import numpy, polarscan
        except ImportError as missing:
            self.skipTest(f"the page about Python: {missing}")
        done = subprocess.run(["/usr/bin/python3", "-c", script], cwd=self.folder, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


class TutorialCamera(Tutorial):
    def test_the_tutorial_runs_on_a_simulated_gige_camera(self):
        camera = subprocess.Popen([PROGRAM, "simulate", "--gige", "127.0.0.1", "--fps", "4", "--width", "160",
                                   "--height", "128", "--samples", "1", "--prepared", "1", "--rings", "30:2"], cwd=self.folder,
                                  stderr=subprocess.PIPE, text=True)
        try:
            self.assertTrue(any("GigE Vision camera at" in line for line in camera.stderr))  # scripts/demo waits for these words, too
            self.assertGreater(self.run_page("tutorial-camera.md", "sh"), 4)
            self.assertTrue((self.folder / "cup/session.json").exists())
        finally:
            camera.send_signal(signal.SIGINT)
            camera.wait(20)
            camera.stderr.close()
