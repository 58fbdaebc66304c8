# SPDX-License-Identifier: Apache-2.0
"""What the documentation tells people to type: every command and option exists, and the tutorials run as they stand, with
smaller pictures. A block that cannot run says so in a comment above it: <!-- not run: why -->, <!-- may fail: why -->."""
import os, re, shlex, shutil, signal, subprocess, tempfile, unittest
from pathlib import Path

ROOT, PROGRAM = Path(__file__).parents[2], os.environ["POLARSCAN_PROGRAM"]
BLOCK = re.compile(r"(?:<!-- (not run|may fail): [^\n]*-->\n)?```(sh|python)\n(.*?)```", re.S)
SMALLER = [(r"--width \d+ --height \d+", "--width 160 --height 128 --samples 1"), (r'preset="fast"', 'preset="fast", rounds=1')]


def help_of(path):
    return subprocess.run([PROGRAM, *path, "--help-all"], capture_output=True, text=True, check=True).stdout


def subcommands(text):
    return re.findall(r"^  ([a-z]+) ", text.split("Subcommands:")[1].split("\nExample:")[0], re.M) if "Subcommands:" in text else []


class Commands(unittest.TestCase):
    def setUp(self):
        self.known = {}

    def words(self, path):
        """(commands below, options) of a command, from its --help-all."""
        if path not in self.known:
            text = help_of(path)
            self.known[path] = (subcommands(text), set(re.findall(r"(?<![\w-])--?[a-z][\w-]*", text)))
        return self.known[path]

    def check(self, line, where):
        path = ()
        line = re.split(r"\s{3,}|\s#|[|&;()]", line)[0]
        for word in shlex.split(line)[1:]:
            below, options = self.words(path)
            if word.startswith("-"):
                if not re.fullmatch(r"--?[A-Za-z][\w-]*(=.*)?", word):
                    continue
                option = word.split("=")[0]
                self.assertIn(option, options | self.words(())[1], f"{where}: {line}")
            elif word in below:
                path += (word,)
            elif not path:
                self.assertIn(word, list(below) + ["COMMAND", "INPUT"], f"{where}: {line}: no such command")

    def test_every_command_and_option_in_the_docs_exists(self):
        count = 0
        for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
            for number, line in enumerate(page.read_text().splitlines(), 1):
                command = re.match(r" {4,}(?:\S*/)?(polarscan (?:--json )?[a-z].*)", line)
                if command and "..." not in command[1] and " | " not in command[1]:
                    self.check(command[1], f"{page.name}:{number}")
                    count += 1
        self.assertGreater(count, 45)

    def test_every_command_shows_an_example_that_exists(self):
        for path in self.all_commands(()):
            examples = re.findall(r"^  (polarscan .*)", help_of(path).split("\nExample:\n")[1], re.M)
            self.assertTrue(any(" ".join(("polarscan",) + path) in line for line in examples), path)
            for line in examples:
                self.check(line, path)

    def test_options_named_in_a_sentence_exist(self):
        everything = "".join(help_of(path) for path in self.all_commands(()))
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

    def run_page(self, page, language):
        ran = 0
        for remark, kind, text in self.blocks(page):
            if kind != language:
                continue
            done = subprocess.run(["sh", "-e", "-c", text], cwd=self.folder, env=self.environment, capture_output=True, text=True)
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
        camera = subprocess.Popen([PROGRAM, "--quiet", "simulate", "--gige", "127.0.0.1", "--fps", "4", "--width", "160",
                                   "--height", "128", "--samples", "1", "--prepared", "1", "--rings", "30:2"], cwd=self.folder,
                                  stderr=subprocess.DEVNULL)
        try:
            self.assertGreater(self.run_page("tutorial-camera.md", "sh"), 4)
            self.assertTrue((self.folder / "cup/session.json").exists())
        finally:
            camera.send_signal(signal.SIGINT)
            camera.wait(20)
