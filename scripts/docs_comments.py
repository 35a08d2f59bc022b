"""Filter for Doxygen: prints a header with its comments as documentation comments.

The comment at the top describes the file, one before a declaration or after it on its line the declaration.
"""
import re
import sys

lines = open(sys.argv[1], encoding='utf-8').read().split('\n')
after_declaration = False
for number, line in enumerate(lines):
    if number == 0 and line.startswith('//'):
        line = '/// \\file\n/// ' + line[2:].strip()
    elif re.match(r'\s*//(\s|$)', line):
        line = ('\n' if after_declaration else '') + re.sub('//', '///', line, count=1)  # otherwise one comment for Doxygen
    elif not re.match(r'\s*(#|})', line):
        line = re.sub(r'(\S)\s+// ', r'\1  ///< ', line, count=1)
    after_declaration = '///<' in line
    print(line)
