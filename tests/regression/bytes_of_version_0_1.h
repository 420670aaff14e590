#pragma once
#include <map>
#include <string>

// SHA-256 of what commit 07c747b writes in bytes_test.cpp, for each instruction set. That of AVX-512 is not
// recorded: no machine that had it was at hand.
inline const std::map<std::string, std::string> kBytesV2{
    {"code baked field", "f1967e32be7d33ee7cad9a2fff39ea47c90a0aaec6521281d220c8ff83fc7385"},
    {"code logits", "2f33211e2731a06e981fd50de867eba067a3a60bb7b14ca8f03202017a8ed72f"},
    {"code owner", "7355e18ffdfcf4523407e94829af563b8713e88a2c74e9a10d53a2d2bf749474"},
    {"code renders", "b916d3926c6fb6477b4873785ba741ee87a77a97a26d1bff1289a019cbb67ce6"},
    {"fast baked field", "357ab2225b7620634944a3f7771d9ce700a45f394b0e34814dcdfe2d11021b4c"},
    {"fast logits", "342409f3bd5e1c4dcd88888a8ee879745474634d608f69835f21f7e32d8d6205"},
    {"fast owner", "77116bceaa7f88bd00ccbc18be1813d77b310323cfed438b7c2521e272a80044"},
    {"fast renders", "153d60992ec1351ef1d0f68309f49733f6c4297f3ed1bbff870cf8d256afe086"},
    {"hash field", "7169f1e7a7340da7cd7253b251b0cd4a79ddbae0180376de07068fb54e49625e"},
    {"mlp field", "7b33409f716c7056416cecc68cb45c617c9aca7da414de414f01d9eeff7cdb82"},
    {"paper baked field", "11667c0ed55084466eda40dc77d70faf025658162d87e0f5b56f808ba270dce6"},
    {"paper logits", "2f33211e2731a06e981fd50de867eba067a3a60bb7b14ca8f03202017a8ed72f"},
    {"paper owner", "69949bc1663c6873a433253cc874c3a82c48c4e747711924f3319e5a8dc696e6"},
    {"paper renders", "937c9a9bd7640d9ae32d16b5b102292027adf672c93059f8cea00d8652712b19"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
inline const std::map<std::string, std::string> kBytesV3{
    {"code baked field", "726fc2de2918d3895748798bd7a69c9e68937fc95c615a0074378d50921ad76e"},
    {"code logits", "2f33211e2731a06e981fd50de867eba067a3a60bb7b14ca8f03202017a8ed72f"},
    {"code owner", "6d88fd27944a70674b9b21f189cdfed4919c8ade39c4e58468bb21dc001f3580"},
    {"code renders", "489de1d3a39036ad622762efb4249505929213ffd003922091a50a6d298ea129"},
    {"fast baked field", "d7c11a46e3360a700caa4ab8b819872512ee1ed09c291097e89fb312be874276"},
    {"fast logits", "02ebf13bb8dc3b17cf7d21c8c0e698e68a336ad1187f34bdfa4a8e6f86e912dc"},
    {"fast owner", "621e68905120b3f2bb56134be302d7a605f950a7b0cbdeeab8fa18b58b054123"},
    {"fast renders", "5d38e68f8b7cb4621295e72eb6b801553fb03a174d82ea8bd41aa0b82b8831b1"},
    {"hash field", "ddb8c16b2d62994a59ed8aa4ae932d923e75564baf99a3cbcda6591352018d07"},
    {"mlp field", "75b9aa11ccbf62dada9278d143ad378beee4521b95c4db7fe9702982666dee32"},
    {"paper baked field", "abdd1397df55be7bbac6a7765239a70609451607993d5bfd95025284c97a0781"},
    {"paper logits", "2f33211e2731a06e981fd50de867eba067a3a60bb7b14ca8f03202017a8ed72f"},
    {"paper owner", "8dd23b4d1570b948f8e9a7ceb0fcff39f4e1898295a7d4dd460fcf2420bf1f3a"},
    {"paper renders", "036feb4021609d9a3305317754218afbab4e2497c7418bf451659f6618189a0e"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
