-- description: A number that a sample has, if it is one that makes sense; numbers of files may be
--     any. 31 years in nanoseconds.
CREATE OR REPLACE MACRO staging.usage_number(word) AS
CASE
    WHEN try_cast(word AS BIGINT) BETWEEN 0 AND 1000000000000000000 THEN try_cast(word AS BIGINT)
END
