-- description: What perf wrote of each stack, and its calls, the outermost first. Where a function
--     keeps no frame pointer, what comes above it in the stack is no code: it is cut off. Python
--     names its functions as 'py::function:file', in a map of its own: C++ may have a namespace py.
--     The function that ran is the innermost one; but what the interpreter, libc and the
--     kernel do for a function of Python alone, that function does. Other libraries, such as numpy,
--     have functions of their own.
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
        stack,
        calls,
        coalesce(
            list_position(list_transform(calls[2:], lambda call: call.file), '[unknown]'),
            len(calls)
        ) AS depth,
        list_transform(
            calls,
            lambda call: CASE
                WHEN call.function LIKE 'py::%' AND regexp_matches(call.file, '/perf-\d+\.map$')
                    THEN 'python'
                -- In brackets stand the kernel and its modules.
                WHEN call.file LIKE '[%' AND call.file <> '[unknown]'
                    OR regexp_matches(
                        call.file,
                        '/(lib)?python3[^/]*$|/(libc|libpthread|ld)(-[\d.]+|-linux[^/]*)?\.so[^/]*$'
                    )
                    THEN 'interpreter'
                ELSE 'library'
            END
        ) AS kinds
    FROM line
    WHERE len(calls) > 0
)
SELECT
    stack,
    list_reverse(list_transform(
        calls[:depth],
        lambda call, place: CASE
            WHEN kinds[place] = 'python'
                THEN regexp_extract(call.function, '^py::([^:]*):(.*)$', ['function', 'file'])
            ELSE call
        END
    )) AS calls,
    CASE
        WHEN list_position(kinds, 'python') < coalesce(list_position(kinds, 'library'), depth + 1)
            THEN depth + 1 - list_position(kinds, 'python')
        ELSE depth
    END AS ran,
    depth < len(calls) AS is_cut
FROM whole
