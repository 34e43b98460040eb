-- title: Samples do not show all functions
-- description: For a part of the samples it is not known which function ran, or what called it.
-- cause: A file without symbols; or code that keeps no frame pointers, such as Python before 3.12.
-- cure: For names, install the debug symbols of that package, or do not strip it. For callers,
--     build with -fno-omit-frame-pointer, or record with --profile 99:dwarf (docs/functions.md).
-- grain: one row per reason that holds for at least a tenth of the samples
-- severity: info
-- when: staging.stack_sample
WITH sample AS (
    SELECT
        f.file, x.is_cut,
        f.function = '[unknown]' AS is_unnamed
    FROM staging.stack_sample AS s
    JOIN staging.stack AS k ON s.stack_id = k.stack_id
    JOIN staging.stack_frame AS f ON k.stack_frame_id = f.stack_frame_id
    JOIN (
        SELECT
            calls,
            bool_and(is_cut) AS is_cut
        FROM staging.stack_text
        GROUP BY calls
    ) AS x ON k.calls = x.calls
),
counted AS (
    SELECT
        count(*) AS samples,
        count(*) FILTER (WHERE is_cut) AS cut,
        count(*) FILTER (WHERE is_unnamed) AS unnamed,
        mode(file) FILTER (WHERE is_unnamed) AS unnamed_file
    FROM sample
)
SELECT
    cut AS count,
    printf('%d of %d samples do not show all callers', cut, samples) AS detail
FROM counted
WHERE cut >= 0.1 * greatest(samples, 1)
UNION ALL
SELECT
    unnamed,
    printf(
        '%d of %d samples do not name the function, most of them in %s', unnamed, samples,
        unnamed_file
    )
FROM counted
WHERE unnamed >= 0.1 * greatest(samples, 1)
