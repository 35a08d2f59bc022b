#!/usr/bin/env python3
import unittest

from tree import Tree

HEADER = 'Text.\n\n| label | form | function | test |\n|---|---|---|---|\n'


def project(rows):
    return Tree({'docs/math.md': HEADER + rows, 'src/solver/residual.h': 'double residual(double u);\n',
                 'tests/solver/residual_test.cc': 'TEST(Residual, AgreesWithItsEquation) {}\nTEST_P( Jacobian , AgreesWithDifferences) {}\n'})


class CheckEquations(unittest.TestCase):
    def test_accepts_rows_with_existing_functions_and_tests(self):
        rows = ('| 1 | e = u - h | `solver::residual` | `Residual.AgreesWithItsEquation` |\n'
                '| 2 | de | `residual` | `Jacobian.AgreesWithDifferences` |\n')
        self.assertEqual(project(rows).run('check_equations'), (0, []))

    def expect_finding(self, row, finding):
        status, lines = project(row).run('check_equations')
        self.assertEqual(status, 1)
        self.assertEqual(len(lines), 1)
        self.assertTrue(lines[0].endswith(f'docs/math.md:5: {finding}'), lines[0])

    def test_reports_the_line_of_a_missing_function(self):
        self.expect_finding('| 1 | e | `residuals` | `Residual.AgreesWithItsEquation` |\n', 'no function residuals in src/')

    def test_reports_the_line_of_a_missing_test(self):
        self.expect_finding('| 1 | e | `residual` | `Residual.Agrees` |\n', 'no test Residual.Agrees')

    def test_requires_function_and_test(self):
        self.expect_finding('| 1 | e | `residual` | |\n', 'no function or no test')

    def test_requires_four_cells(self):
        self.expect_finding('| 1 | e | `residual` | `Residual.AgreesWithItsEquation` | more |\n', 'a row must have four cells')

    def test_rejects_a_page_without_a_table(self):
        self.assertEqual(Tree({'docs/math.md': 'Text.\n'}).run('check_equations')[0], 1)


if __name__ == '__main__':
    unittest.main()
