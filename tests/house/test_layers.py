# SPDX-License-Identifier: Apache-2.0
"""What may include what: ARCHITECTURE.md's table, held against every #include."""
import collections
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).parents[2]
# Mathematics without files: what takes arrays and gives arrays.
WITHOUT_FILES = ['stereo/costs', 'stereo/search', 'stereo/rounds', 'stereo/contours', 'fusion/surface']
OPENS = re.compile(r'<(fstream|cstdio|filesystem|fcntl\.h|tiffio\.h)>|"core/(files|formats)/'
                   r'|"stereo/(workspace|map_io)\.h"|"stereo/dense/')


def table():
    """{house: houses that it may include} from the lines `| \\`house/\\` | what is in it | may include |`."""
    rows = re.findall(r'^\| `([\w/]+)/` \|[^|]*\| ([^|]*) \|$', (ROOT / 'ARCHITECTURE.md').read_text(), re.M)
    return {house: re.findall(r'`([\w/.]+)`', allowed) for house, allowed in rows}


def house_of(path, houses):
    fits = [h for h in houses if path == h or path.startswith(h + '/')]
    return max(fits, key=len, default=None)


def sources(houses):
    for house in sorted({h.split('/')[0] for h in houses}):
        for path in sorted((ROOT / house).rglob('*')):
            if path.suffix in ('.h', '.cpp'):
                yield str(path.relative_to(ROOT)), path.read_text()


def local_names(text):
    """Types, constants, and functions with the types of their parameters, of a source's unnamed namespaces."""
    for block in re.findall(r'^namespace \{\n(.*?)^\}  // namespace$', text, re.S | re.M):
        yield from re.findall(r'^(?:struct|class|enum class|enum) (\w+)[^;]*?\{', block, re.M)
        yield from re.findall(r'^(?:inline |static )*(?:constexpr|const) [\w:<>, ]*?[ &*](\w+)(?:\[\w*\])?(?: =|\{|;)', block, re.M)
        for name, parameters in re.findall(r'^(?!struct|class|enum|using|constexpr [^(]*=|template| )[\w:<>,&* ]*?\b(\w+)\(([^{};]*?)\)'
                                           r'(?: const)?(?: noexcept)? \{', block, re.M):
            types = [re.sub(r'\s*=.*|(?<=[ &*])\w+$', '', ' '.join(p.split())).strip() for p in re.split(r',(?![^<(]*[>)])', parameters)]
            yield f'{name}({", ".join(types)})'


class Layers(unittest.TestCase):
    def test_a_house_includes_only_what_the_table_allows(self):
        allowed = table()
        self.assertGreater(len(allowed), 8, 'ARCHITECTURE.md holds no table')
        wrong, seen = [], 0
        for path, text in sources(allowed):
            house = house_of(path, allowed)
            for target in re.findall(r'#include "([^"]+/[^"]+)"', text):
                other = house_of(target, allowed)
                seen += 1
                self.assertIsNotNone(other, f'{path} includes {target}, which is in no house of the table')
                if other != house and not any(target == a or target.startswith(a + '/') for a in allowed[house]):
                    wrong.append(f'{path} includes {target}')
        self.assertGreater(seen, 500)
        self.assertEqual(wrong, [])

    def test_mathematics_opens_no_files(self):
        wrong = [f'{path}: {line}' for path, text in sources(WITHOUT_FILES) for line in text.split('\n')
                 if path.startswith(tuple(WITHOUT_FILES)) and line.startswith('#include') and OPENS.search(line)]
        self.assertEqual(wrong, [])

    def test_sources_of_a_library_may_be_compiled_as_one(self):
        """Unity builds put them together in groups that change with every new file."""
        seen = collections.defaultdict(set)
        for path, text in sources(table()):
            for name in local_names(text) if path.endswith('.cpp') else []:
                seen[path.split('/')[0], name].add(path)
        self.assertGreater(len(seen), 1000)
        self.assertEqual({name: paths for name, paths in seen.items() if len(paths) > 1}, {})
        functions = {(house, name.split('(')[0]) for house, name in seen if '(' in name}
        self.assertEqual([name for name in seen if name in functions], [], 'a type or constant, and a function')
        types = {name for path, text in sources(table()) if path.endswith('.h')
                 for name in re.findall(r'^(?:struct|class|enum class|using) (\w+)', text, re.M)}
        self.assertGreater(len(types), 200)
        self.assertEqual([(name, paths) for (_, name), paths in seen.items() if name in types], [])


if __name__ == '__main__':
    unittest.main()
