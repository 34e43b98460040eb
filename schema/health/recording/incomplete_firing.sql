-- title: Publications for which an input had no message
-- description: Publications that an annotation explains, but for which some of its inputs had no
--     message.
-- cause: No message had come yet, none since the caches were emptied, one came only meanwhile, or a
--     gap lies in between.
-- cure: None needed; annotation_firing has each of them.
-- grain: one row per run
-- severity: info
-- when: store.annotation
SELECT
    run_id,
    count(*) AS count,
    'publications that an annotation explains, but for which some of its inputs had no message '
    || 'when the callback that publishes began (none yet, none since the caches were emptied, one '
    || 'that came only meanwhile, or a gap lies in between): see annotation_firing' AS detail
FROM main.annotation_firing
WHERE linked_count < input_count
GROUP BY run_id
