-- description: A recorded GID as 16 bytes, NULL where it is absent or all zeros. Longer arrays end
--     in garbage in several distributions.
CREATE OR REPLACE MACRO staging.gid_bytes(gid) AS
CASE
    WHEN gid IS NULL OR len(gid) < 16 OR list_sum(gid[1:16]) = 0 THEN NULL
    ELSE unhex(
        list_aggregate(list_transform(gid[1:16], lambda b: printf('%02x', b)), 'string_agg', '')
    )
END
