#!/usr/bin/env python3
import unittest

from tree import Tree

TABLE = '''
bslam_layer(base LINKS Threads::Threads)
bslam_layer(geometry USES base LINKS Eigen3::Eigen)  # the line of geometry USES nothing else
bslam_layer(map USES geometry)
'''


def project(files, table=TABLE):
    used = {'src/base/id.h': '', 'src/geometry/se3.h': '#include "base/id.h"\n', 'src/map/map.h': '#include "geometry/se3.h"\n'}
    return Tree({'src/CMakeLists.txt': table, **used, **files})


class CheckLayers(unittest.TestCase):
    def test_accepts_a_tree_that_satisfies_its_table(self):
        self.assertEqual(project({'src/cli/main.cc': '#include "map/map.h"\n#include <vector>\n'}).run('check_layers'), (0, []))

    def test_accepts_indirectly_used_layers(self):
        self.assertEqual(project({'src/map/edit.h': '#include "base/id.h"\n'}).run('check_layers'), (0, []))

    def test_reports_file_and_line_of_an_upward_include(self):
        status, lines = project({'src/geometry/bad.cc': '#include "geometry/se3.h"\n  #  include "map/map.h"\n'}).run('check_layers')
        self.assertEqual((status, lines), (1, ['src/geometry/bad.cc:2: geometry may not include map ("map/map.h")']))

    def test_rejects_a_path_without_a_layer(self):
        status, lines = project({'src/map/bad.cc': '#include "map.h"\n'}).run('check_layers')
        self.assertEqual((status, lines), (1, ['src/map/bad.cc:1: "map.h" does not begin with a layer of src/']))

    def test_rejects_a_folder_that_is_not_in_the_table(self):
        status, lines = project({'src/new/a.cc': '#include "base/id.h"\n'}).run('check_layers')
        self.assertEqual((status, lines), (1, ['src/new/a.cc:1: src/new is not a layer of src/CMakeLists.txt']))

    def test_reports_unused_layers(self):
        table = TABLE.replace('map USES geometry', 'map USES base geometry')
        status, lines = project({}, table).run('check_layers')
        self.assertEqual((status, lines), (1, ['src/CMakeLists.txt: map uses base but includes none of its headers']))

    def test_reports_a_layer_declared_after_its_user(self):
        status, lines = project({}, 'bslam_layer(map USES geometry)\n' + TABLE.replace('bslam_layer(map USES geometry)\n', '')).run('check_layers')
        self.assertEqual(status, 1)
        self.assertIn('src/CMakeLists.txt: layer map uses geometry, which is not declared above it', lines)

    def test_rejects_an_empty_folder(self):
        self.assertEqual(Tree({}).run('check_layers')[0], 1)
        self.assertEqual(Tree({'src/CMakeLists.txt': ''}).run('check_layers')[0], 1)


if __name__ == '__main__':
    unittest.main()
