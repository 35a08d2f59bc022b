#!/usr/bin/env python3
import unittest

from tree import Tree, load

check_sizes = load('check_sizes')


def function_of(lines, name='f'):
    """Returns a function with the given number of lines of code."""
    return f'int {name}() {{\n' + '  work();\n' * (lines - 2) + '}\n'


def lengths(text):
    return {name: length for name, _, length in check_sizes.functions(check_sizes.without_comments(text))}


def findings(files, exceptions=None):
    return check_sizes.check_tree(Tree(files).root, exceptions or {})[0]


class Functions(unittest.TestCase):
    def test_counts_signature_and_braces_but_no_comments_or_blank_lines(self):
        self.assertEqual(lengths('// what f does\nint f(int a,\n      int b) {\n\n  // why\n  return a;  // so\n  /* or\n not */\n}\n'),
                         {'f': 4})

    def test_counts_lambdas_and_local_classes_as_part_of_the_enclosing_function(self):
        text = 'void f() {\n  struct S {\n    int g() { return 1; }\n  };\n  const auto h = [&] {\n    return 2;\n  };\n}\n'
        self.assertEqual(lengths(text), {'f': 8})

    def test_finds_members_in_namespaces_and_classes(self):
        text = ('namespace a {\nnamespace {\nclass C : public B {\n public:\n  C() : x_(1), y_{2} {}\n  int get() const {\n    return x_;\n  }\n'
                ' private:\n  int x_ = 0, y_{1};\n};\n}\nint C::far(int v) {\n  return v;\n}\n}\n')
        found = lengths(text)
        self.assertEqual((found['get'], found['C::far'], found['C']), (3, 3, 1))

    def test_ignores_braces_of_values_and_in_literals(self):
        text = ('const int table[] = {1, 2, 3};\nconst char* const t = "}{ int g() {";\nconst char c = \'{\';\n'
                'const char* const r = R"(int h() {)";\nenum class E { kA, kB };\n#define X() {\nint f() {\n  return 1;\n}\n')
        self.assertEqual(lengths(text), {'f': 3})

    def test_templates_and_operators(self):
        text = ('template <class T, std::size_t N>\nstd::array<T, N> f(const T& t) {\n  return {};\n}\n'
                'bool operator==(const A& a, const A& b) {\n  return true;\n}\n')
        self.assertEqual(sorted(lengths(text).values()), [3, 4])


class Limits(unittest.TestCase):
    def test_rejects_functions_beyond_the_limit(self):
        short = ''.join(function_of(3, f's{i}') for i in range(40))
        self.assertEqual(findings({'src/a/a.cc': short + function_of(45)}), [])
        self.assertEqual(findings({'src/a/a.cc': short + function_of(46)}),
                         ['src/a/a.cc:121: f has 46 lines of code; the limit is 45'])

    def test_rejects_files_beyond_the_limit(self):
        self.assertEqual(findings({'src/a/a.h': function_of(3) + '\n' * 397}), [])
        self.assertEqual(findings({'src/a/a.h': function_of(3) + '\n' * 398}), ['src/a/a.h:401: 401 lines; the limit is 400'])

    def test_rejects_more_than_five_percent_of_functions_beyond_27_lines(self):
        def tree(short, long):
            files = {f'src/a/short{i}.cc': function_of(27) for i in range(short)}
            return files | {f'src/a/long{i}.cc': function_of(40) for i in range(long)}
        self.assertEqual(findings(tree(96, 4)), [])
        self.assertEqual(findings(tree(90, 10)), ['src: the 95th percentile of the functions is 40 lines of code; the limit is 27'])

    def test_applies_exceptions_and_reports_unused_ones(self):
        short = ''.join(function_of(3, f's{i}') for i in range(40))
        files = {'src/a/a.cc': short + function_of(46)}
        self.assertEqual(findings(files, {'src/a/a.cc: f': 'why'}), [])
        self.assertEqual(findings(files, {'src/a/a.cc: f': 'why', 'src/a/b.cc': 'why'}),
                         ['src/a/b.cc: unused exception of check_sizes'])

    def test_rejects_an_empty_folder(self):
        self.assertEqual(Tree({}).run('check_sizes')[0], 1)


if __name__ == '__main__':
    unittest.main()
