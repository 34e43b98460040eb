-- name: finding.ambiguous_link
-- title: Messages that several publications could have been
-- description: The publication of a message was chosen among several.
-- cause: Messages carry no stamp of their publication, or several have the same one.
-- cure: Leave out links with a candidate_count above 1 where only certain ones are to count.
-- grain: one row per run
-- severity: warning
-- when: store.link_transport WHERE candidate_count > 1
SELECT
    run_id,
    count(*) AS count,
    'messages that several publications could have been: see candidate_count of link_transport'
        AS detail
FROM store.link_transport
WHERE candidate_count > 1
GROUP BY run_id
