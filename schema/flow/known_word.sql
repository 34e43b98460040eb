-- description: True if a word is one of those that a macro knows. Else an error that names them:
--     an unknown word must not be answered with no rows.
CREATE OR REPLACE MACRO derive.known_word(parameter, word, known) AS
CASE WHEN list_contains(known, word) THEN true
    ELSE error(
        printf(
            '%s is one of %s, not %s',
            parameter, array_to_string(known, ', '), coalesce(word::VARCHAR, 'NULL')
        )
    )
END
