"""The page that says where things are links files that exist, and quotes what is in them."""

from __future__ import annotations

import re

import pytest
from support.followed import ROOT

PAGE = ROOT / "docs" / "explanation" / "where-things-are.md"
QUESTIONS = dict(
    part.split("\n", 1) for part in PAGE.read_text(encoding="utf-8").split("\n## ")[1:]
)
ANSWER = re.compile(r"^- \[([^\]]+)\]\(([^)]+)\): (.+?)(?=\n- |\Z)", re.MULTILINE | re.DOTALL)


def test_there_are_ten_questions() -> None:
    assert len(QUESTIONS) == 10
    assert all(question.endswith("?") for question in QUESTIONS)


@pytest.mark.parametrize("question", QUESTIONS)
def test_an_answer_is_three_files_at_most_each_with_one_sentence(question: str) -> None:
    answers = ANSWER.findall(QUESTIONS[question].strip())
    assert 1 <= len(answers) <= 3
    assert QUESTIONS[question].count("\n- ") == len(answers)
    for _, _, sentence in answers:
        assert re.search(r"[.:]\s", re.sub(r"`[^`]+`", "", sentence)) is None
        assert sentence.endswith(".")


@pytest.mark.parametrize("question", QUESTIONS)
def test_a_linked_file_exists_and_holds_what_is_quoted(question: str) -> None:
    for name, link, sentence in ANSWER.findall(QUESTIONS[question].strip()):
        file = (PAGE.parent / link).resolve()
        assert file.as_posix().endswith(f"/{name}")
        text = file.read_text(encoding="utf-8")
        quoted = re.findall(r"`([^`]+)`", sentence)
        assert quoted
        assert [words for words in quoted if words not in text] == []
