#!/usr/bin/env python3
import unittest

from tree import Tree

HEADER = 'Text.\n\n| label | form | function | test |\n|---|---|---|---|\n'


def project(rows):
    return Tree({'docs/math.md': HEADER + rows, 'src/solver/residual.h': 'double residual(double u);\n',
                 'tests/solver/residual_test.cc': 'TEST(Residual, IsThatOfItsEquation) {}\nTEST_P( Jacobian , AgreesWithDifferences) {}\n'})


class CheckEquations(unittest.TestCase):
    def test_accepts_rows_whose_function_and_test_exist(self):
        rows = ('| 1 | e = u - h | `solver::residual` | `Residual.IsThatOfItsEquation` |\n'
                '| 2 | de | `residual` | `Jacobian.AgreesWithDifferences` |\n')
        self.assertEqual(project(rows).run('check_equations'), (0, []))

    def expect_finding(self, row, finding):
        status, lines = project(row).run('check_equations')
        self.assertEqual(status, 1)
        self.assertEqual(len(lines), 1)
        self.assertTrue(lines[0].endswith(f'docs/math.md:5: {finding}'), lines[0])

    def test_names_the_line_of_a_function_that_is_not_there(self):
        self.expect_finding('| 1 | e | `residuals` | `Residual.IsThatOfItsEquation` |\n', 'no function residuals in src/')

    def test_names_the_line_of_a_test_that_is_not_there(self):
        self.expect_finding('| 1 | e | `residual` | `Residual.IsThat` |\n', 'no test Residual.IsThat')

    def test_a_row_needs_function_and_test(self):
        self.expect_finding('| 1 | e | `residual` | |\n', 'no function or no test')

    def test_a_row_has_four_cells(self):
        self.expect_finding('| 1 | e | `residual` | `Residual.IsThatOfItsEquation` | more |\n', 'a row has four cells')

    def test_a_page_without_the_table_is_a_finding(self):
        self.assertEqual(Tree({'docs/math.md': 'Text.\n'}).run('check_equations')[0], 1)


if __name__ == '__main__':
    unittest.main()
