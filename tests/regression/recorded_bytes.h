#pragma once
#include <map>
#include <string>

// SHA-256 of the files of bytes_test.cpp, for each instruction set. Scene and fields were recorded at commit
// 07c747b; owners and all that is made with them, at the commit where Muon began to train the extractor's
// matrices; baked fields and what is read from them, at the commit that bakes with larger steps and batches.
// AVX-512 is not recorded.
inline const std::map<std::string, std::string> kBytesV2{
    {"code baked field", "5e345d28aef098b971e3480e1243a27ad2bb96e2bca1cc9521771cfe1821d8f7"},
    {"code logits", "9613e54e8692e34788c1420773b95ac1f73cad031192077e2866490bda867c3e"},
    {"code owner", "7d93be5dbf71220a5dd26118b7514153c369100f804bd41a38433ed5da88c08b"},
    {"code renders", "3f15ea28b1f1433f3de0e82306ed2662d812a5628b4cac25e6e346da12acdaff"},
    {"fast baked field", "9c54964dc8973b8f2f5d30914c465ee0a67398ff03166164c9bcd2dd535d9972"},
    {"fast logits", "41b1bc2378856d2b9eb354e923a1f17ae21f15dfc49a8ab56834b76e77613c96"},
    {"fast owner", "ab8f0c665630754bf4a27782b7df777e8bb0823629d1ba6e993522341c8f542a"},
    {"fast renders", "2985d3589d6e00333f30f7b0d3cb5b29e79f499ff68e7e23d12ff2d202ff136c"},
    {"hash field", "7169f1e7a7340da7cd7253b251b0cd4a79ddbae0180376de07068fb54e49625e"},
    {"mlp field", "7b33409f716c7056416cecc68cb45c617c9aca7da414de414f01d9eeff7cdb82"},
    {"paper baked field", "ea12594ce1a9153adeb5e35f2dc69bb26fb00383e8f029d681346ef65fa2aea2"},
    {"paper logits", "56e424adb296950876ab8f3e014143aa29f7599de504457f2c42197769474182"},
    {"paper owner", "8832ad2aaf0cf5a67b3e5cf139d284ff1bb027be25712b55daa76aac88f65a8f"},
    {"paper renders", "b5ab0a901fad955afaf0d92612cbb9118366b454c3c94c1632152888a039150e"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
inline const std::map<std::string, std::string> kBytesV3{
    {"code baked field", "b12c746f702a26dc062622e640fd78a671f91646cae9568dc6858addc494f7c6"},
    {"code logits", "8798f00cac051ef6e4f4ba6f06c2389cebdf7bce16bd67f3ed649cf481cbd2d3"},
    {"code owner", "984dc2b560f17c500cf72d6efcfcb3fed3f35fc6e1e909ce7b43f8a93e039e02"},
    {"code renders", "a613e8e9229dfcd69a5c1b08eb00f16d58425f86c41a932968996996a00a70aa"},
    {"fast baked field", "642aaf8be258bf24eaebd4d974066b2b697bba2d8e89bfe969766e52e38eefe1"},
    {"fast logits", "73f874173149377e5dbf8f2a2ac009be46817841826cc92c88fd9a1e51786090"},
    {"fast owner", "3f494d85d7d875c3b5fce6b197f43bbeae254c4823c4f55f4a6308f0be05245a"},
    {"fast renders", "07a51bb86a7d0a2c88e2a4d35aaceb02668d0f8f581a548e24431d317daa29e5"},
    {"hash field", "ddb8c16b2d62994a59ed8aa4ae932d923e75564baf99a3cbcda6591352018d07"},
    {"mlp field", "75b9aa11ccbf62dada9278d143ad378beee4521b95c4db7fe9702982666dee32"},
    {"paper baked field", "01347cb934811415ba0c6e33b60dafd11882990693d3ba3741c5d0d59b27d8f8"},
    {"paper logits", "56e424adb296950876ab8f3e014143aa29f7599de504457f2c42197769474182"},
    {"paper owner", "fb1cc7681d1f0734899f2397d4e96295e8496bd6b9f5e664518a5a4f815593d3"},
    {"paper renders", "2e638b2c3b810015e3ed281871bc5f9ae7f5e5ca7e305f4fb4d8a7eece5b9baa"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
