-- description: What perf wrote of each stack, and its calls, the outermost first. Where a function
--     keeps no frame pointer, what comes above it in the stack is no code: it is cut off. Python
--     names its functions as 'py::function:file', in a map of its own: C++ may have a namespace py.
-- grain: one row per different text
-- when: staging.sample_text
WITH line AS (
    SELECT
        stack,
        list_filter(
            list_transform(
                string_split(stack, chr(10)),
                lambda line: regexp_extract(
                    line, '^\s*[0-9a-f]+ (.*?) \(([/\[].*)\)$', ['function', 'file']
                )
            ),
            lambda call: call.file <> ''
        ) AS calls
    FROM (SELECT DISTINCT stack FROM staging.sample_text)
),
whole AS (
    SELECT
        *,
        coalesce(
            list_position(list_transform(calls[2:], lambda call: call.file), '[unknown]'), 0
        ) AS cut
    FROM line
)
SELECT
    stack,
    list_transform(
        list_reverse(CASE WHEN cut > 0 THEN calls[:cut] ELSE calls END),
        lambda call: CASE
            WHEN call.function LIKE 'py::%' AND regexp_matches(call.file, '/perf-\d+\.map$')
                THEN regexp_extract(call.function, '^py::([^:]*):(.*)$', ['function', 'file'])
            ELSE call
        END
    ) AS calls,
    cut > 0 AS is_cut
FROM whole
WHERE len(calls) > 0
