"""The lines that count as lines of a program."""

from source_lines import lines


def test_blanks_and_comments_do_not_count():
    source = """
    // a comment
    /* one of
       several lines */
    int a; // beside code
    /* before */ int b;
    const char *text = "/* no comment // at all";

    }
    """
    assert lines(source) == 4
    assert lines('"a \\" // b"; /* c */\n\n') == 1
    assert lines("") == 0
