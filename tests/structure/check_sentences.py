"""Fails if a sentence has more than 30 words up to a full stop, colon or semicolon: in // comments of the
sources, and in pages.

    python3 tests/structure/check_sentences.py [folder of the project]

A comment is a run of lines that are comments alone, or what follows code on one line. Lists, blank lines
and indented examples end a sentence. Of pages, tables, code and titles are left out.
"""
import pathlib
import re
import sys

MOST_WORDS = 30
SUFFIXES = (".h", ".cpp", ".cu", ".cuh")
LEFT_OUT = re.compile(r"^(build|out)|^\.")  # folders
LIST_ITEM = re.compile(r"^([-*+]|\d+[.)])\s+")
SENTENCE_END = re.compile(r"(?<=[.!?:;])[)\"'*_`]*\s+")


def files(root):
    for path in sorted(root.rglob("*")):
        folders = path.relative_to(root).parts[:-1]
        if path.is_file() and not any(LEFT_OUT.match(folder) for folder in folders):
            yield path


def comment_lines(text):
    """(line number, text) of each comment line; text is None between two comments."""
    for number, line in enumerate(text.splitlines(), 1):
        whole = re.match(r"\s*//[/!]?<?( ?.*)$", line)
        if whole:
            yield number, None if re.match(r"\s{3,}\S", whole[1]) else whole[1].strip()
            continue
        yield number, None
        code = re.sub(r'"(\\.|[^"\\])*"', '""', line)
        if "//" in code:
            yield number, code.split("//", 1)[1].lstrip("/!< ")
            yield number, None


def page_lines(text):
    in_code = False
    for number, line in enumerate(text.splitlines(), 1):
        fence = line.lstrip().startswith("```")
        in_code ^= fence
        is_text = not (fence or in_code or line.lstrip().startswith(("|", "#", "<")))
        yield number, line.strip() if is_text else None


def paragraphs(lines):
    """(number of the first line, text) of what belongs together."""
    first, words = 0, []
    for number, line in [*lines, (0, None)]:
        is_item = line and LIST_ITEM.match(line)
        if words and (not line or is_item):
            yield first, " ".join(words)
            words = []
        if line:
            first = first if words else number
            words.append(LIST_ITEM.sub("", line) if is_item else line)


def count_words(sentence):
    return sum(bool(re.search(r"\w", word)) for word in re.sub(r"\]\([^)]*\)", "]", sentence).split())


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    failures = 0
    for path in files(root):
        if path.suffix not in SUFFIXES and path.suffix != ".md":
            continue
        text = path.read_text(encoding="utf-8")
        lines = page_lines(text) if path.suffix == ".md" else comment_lines(text)
        for number, paragraph in paragraphs(lines):
            for sentence in SENTENCE_END.split(paragraph):
                count = count_words(sentence)
                if count > MOST_WORDS:
                    print(f"{path.relative_to(root)}:{number}: {count} words: {sentence}")
                    failures += 1
    sys.exit(1 if failures else 0)


main()
