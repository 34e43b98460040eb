-- title: It is not certain which messages led to what a node published
-- description: The declaration of an indirect link says which inputs a node publishes for, and for
--     some publications several messages of an input fit. Flows follow the likeliest of them all
--     the same: paths and latencies count these flows in their column ambiguous.
-- cause: Callbacks of the inputs overlapped on several threads, or were nested. Of messages that
--     approximate_sync puts together, the headers may be older than the publications.
-- cure: Next time, give the inputs and the output one mutually exclusive callback group, or stamp
--     headers when messages are published (docs/links.md says what each link is marked for).
-- grain: one row per node
-- severity: warning
-- when: store.link_causal WHERE annotation_id IS NOT NULL AND candidate_count > 1
WITH output AS (
    SELECT
        l.run_id, p.process_id, p.node_id, p.topic_name,
        count(*) AS links,
        count(*) FILTER (WHERE l.candidate_count > 1) AS doubted
    FROM derive.certain_cause AS l
    JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
    WHERE l.annotation_id IS NOT NULL
    GROUP BY l.run_id, p.process_id, p.node_id, p.topic_name
    HAVING doubted > 0
)
SELECT
    run_id, process_id, node_id,
    sum(doubted)::BIGINT AS count,
    string_agg(
        printf(
            '%d of %s that led to %s may be others',
            doubted, derive.counted(links, 'message'), coalesce(topic_name, '?')
        ),
        ', ' ORDER BY topic_name, doubted
    ) AS detail
FROM output
GROUP BY run_id, process_id, node_id
