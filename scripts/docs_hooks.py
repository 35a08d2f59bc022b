"""Hooks of MkDocs for the documentation site (mkdocs.yml).

Adds the pages of the root folder, the results of the README and the reference made by Doxygen, and adapts Markdown written for GitHub: a list needs a
blank line before it, `|` needs no backslash in code, and the text of a link is the title of a page instead of its file name.
Drawings of docs/images/diagrams become part of the page, so that they have its colours.
"""
import os
import pathlib
import re

from mkdocs.structure.files import File

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGES = {'ARCHITECTURE.md': 'architecture.md', 'CONTRIBUTING.md': 'contributing.md'}
LIST_ITEM = re.compile(r'(?:[-*]|\d+\.) ')


def with_local_links(text):
    """The text of a page of the root folder, with links to pages of docs/ and to each other as they are in the site."""
    text = re.sub(r'\]\(docs/', '](', text)
    text = re.sub(r'`docs/([a-z_]+\.md)`', r'[\1](\1)', text)
    for name, page in PAGES.items():
        text = text.replace(f'`{name}`', f'[{name}]({page})').replace(f']({name})', f']({page})')
    return text


def on_files(files, config):
    for name, page in PAGES.items():
        files.append(File.generated(config, page, content=with_local_links((ROOT / name).read_text())))
    results = re.search(r'^## (Results\n.*?)^## ', (ROOT / 'README.md').read_text(), re.MULTILINE | re.DOTALL)
    files.append(File.generated(config, 'results.md', content='# ' + with_local_links(results.group(1))))
    reference = os.environ.get('BSLAM_REFERENCE')
    if reference:
        for path in sorted(pathlib.Path(reference).rglob('*')):
            if path.is_file():
                target = pathlib.PurePosixPath('reference', path.relative_to(reference).as_posix())
                files.append(File.generated(config, str(target), abs_src_path=str(path)))
    return files


def with_blank_lines_before_lists(lines):
    fenced, previous = False, ''
    for line in lines:
        if line.lstrip().startswith('```'):
            fenced = not fenced
        begins = LIST_ITEM.match(line) and previous.strip() and not LIST_ITEM.match(previous) and previous[0] != ' '
        if begins and not fenced and not previous.startswith(('|', '#')):
            yield ''
        yield line
        previous = line


def with_diagrams(text):
    def drawing(match):
        svg = (ROOT / 'docs' / match.group(2)).read_text()
        return f'<div class="diagram" role="img" aria-label="{match.group(1)}">{re.sub(chr(10), " ", svg)}</div>'
    return re.sub(r'^!\[([^\]]*)\]\((images/diagrams/[^)]*\.svg)\)$', drawing, text, flags=re.MULTILINE)


def with_plain_bars(line):
    return re.sub(r'`[^`]+`', lambda code: code.group(0).replace('\\|', '|'), line) if line.startswith('|') else line


def with_titles(text, files):
    def title(match):
        file = files.get_file_from_path(match.group(1))
        return f'[{file.page.title}]' if file and file.page and file.page.title else match.group(0)
    return re.sub(r'\[([a-z_]+\.md)\](?=\(\1)', title, text)


def on_page_markdown(markdown, page, config, files):
    lines = [with_plain_bars(line) for line in with_blank_lines_before_lists(markdown.split('\n'))]
    return with_diagrams(with_titles('\n'.join(lines), files))
