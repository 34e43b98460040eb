-- description: Names of a group in words: the first three, and how many more there are.
CREATE OR REPLACE MACRO derive.names_in_words(names) AS
array_to_string(list(DISTINCT names ORDER BY names)[:3], ', ')
|| CASE WHEN count(DISTINCT names) > 3 THEN printf(' and %d more', count(DISTINCT names) - 3)
    ELSE '' END
